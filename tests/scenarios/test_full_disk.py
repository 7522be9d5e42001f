"""A disk that takes no more: said clearly, and the fleet comes to a hold."""

import errno
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import pytest

from base_station.journal import Inputs
from base_station.listeners import EventLog, TelemetryLogs
from base_station.records import Event
from hil.mavlink import RoverMode
from hil.scenario import load_scenario
from tests.conftest import SCENARIOS
from tests.scenarios.bench import run_until_ended, scripted, start

FULL = Path("/dev/full")


class FullAfter:
    """A journal whose disk fills up."""

    is_long = False

    def __init__(self, steps: int) -> None:
        self._left = steps

    def inputs(self, _inputs: Inputs) -> None:
        self._left -= 1
        if self._left < 0:
            raise OSError(errno.ENOSPC, "No space left on device")

    def outputs(self, sent: object, events: Sequence[Event]) -> None: ...

    def begin_anew(self) -> None: ...


def test_a_journal_that_cannot_be_written_ends_in_a_hold() -> None:
    scenario = load_scenario(SCENARIOS / "rescue.yaml")
    rig, heard, times = start(scenario, scripted(0.8), FullAfter(100))
    run_until_ended(rig, times)
    assert rig.time_s < 10.0
    desk = rig.node.station.desk
    reason = "the journal cannot be written: No space left on device"
    assert heard.texts("end") == [f"holding: {reason}"]
    assert [t.status.mode for t in desk.fleet.tracks] == [RoverMode.HOLD] * 3


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full")
@pytest.mark.parametrize("name", ["rover_2.tlog", "events.jsonl"])
def test_logs_on_a_full_disk_end_in_a_hold(name: str, tmp_path: Path) -> None:
    (tmp_path / name).symlink_to(FULL)
    scenario = load_scenario(SCENARIOS / "rescue.yaml")
    rig, heard, times = start(scenario, scripted(0.8))
    logs = TelemetryLogs(tmp_path, rig.node.station.desk.view)
    events = EventLog(tmp_path / "events.jsonl")
    rig.node.take_over(rig.station_links, rig.planner, [heard, logs, events], None)
    run_until_ended(rig, times)
    for writer in (logs, events):
        with suppress(OSError):
            writer.close()
    assert rig.time_s < 10.0
    (end,) = heard.texts("end")
    what = "the telemetry log" if name.endswith("tlog") else "events.jsonl"
    assert end == f"holding: {what} cannot be written: No space left on device"
