"""A station killed over and over, in a run over UDP, goes on by its journal to the right end."""

import json
import sys
from pathlib import Path

import pytest
from children import HIL, ROOT, child
from test_run import VICTIMS, assert_gone, assert_recording_reads, descendants, kill_one, wait_line

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")

RESCUE = ROOT / "scenarios" / "rescue.yaml"
STATION = VICTIMS["station"][0]
RESUMED = "--resume . "
MOMENTS = ("tiny displacements", "drive plan alpha", "drive plan beta")


@pytest.mark.timeout(600)
def test_a_station_killed_in_three_phases_brings_the_mission_to_its_end(tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = (*HIL, "run", str(RESCUE), "--out", str(out), "--speed", "0", "--restart-station")
    with child(*command, "--set", "planning.planner=cem") as run:
        seen = {}
        for moment, pattern in zip(MOMENTS, (STATION, RESUMED, RESUMED), strict=True):
            wait_line(run, moment)
            processes = descendants(run.process.pid)
            seen |= processes
            kill_one(processes, pattern)
        assert run.wait(400.0) == 0, run.stderr()
    assert_gone(seen)
    result = json.loads((out / "result.json").read_text())
    assert result["verdict"]["hypothesis"] == "motor_y_off"
    assert result["correct"] is True
    events = [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]
    assert sum("restarted" in event["text"] for event in events) == len(MOMENTS)
    own = [json.loads(line) for line in (out / "station-events.jsonl").read_text().splitlines()]
    assert [e["text"] for e in own if e["kind"] == "verdict"]
    assert len(list(out.glob("journal-*.bin"))) == 1 + len(MOMENTS)
    assert_recording_reads(out / "mission.rrd")
