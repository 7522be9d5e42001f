"""A station that dies, or starves, in the middle of its work: what it believes and does after."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from base_station.journal import Head, Inputs, Journal, journal_files, read_journal
from base_station.node import Keeper
from base_station.resuming import resume
from hil.bench.folders import blind_view
from hil.bench.rig import Rig
from hil.errors import InputError
from hil.mavlink import Decoder, Encoder, LocalSetpoint, RoverMode, key_of
from hil.scenario import Safety, Scenario, StationView, load_scenario
from tests.conftest import SCENARIOS
from tests.scenarios.bench import Heard, run_until_ended, scripted, start

DEAD_S = 4.0
RIGHT = {"rescue": "motor_y_off", "stuck_gps": "gps_east_stuck"}
MOMENTS = [  # the suspect alone decides in stuck_gps, and does not in rescue
    ("rescue", "probe", 7.0),
    ("rescue", "experiment", 25.0),
    ("rescue", "plan_alpha", 31.0),
    ("rescue", "experiment", 33.5),
    ("stuck_gps", "probe", 7.0),
    ("stuck_gps", "experiment", 22.2),  # while it drives blind, nobody knows how far it went
]


class Dead:
    """In the place of a station that does not run."""

    finished = False

    def step(self, wall_s: float, epoch_us: int) -> None: ...


@dataclass
class Bench:
    """A rig whose station writes a journal, and may die and live again."""

    scenario: Scenario
    folder: Path
    key: bytes | None = None
    safety: Safety | None = None
    heard: Heard = field(init=False)

    def __post_init__(self) -> None:
        self.rig, self.heard, self.times = start(
            self.scenario, scripted(0.8), self._journal(resumed=False), self.key
        )
        if self.safety is not None:
            self.rig.node.station.desk.view = self._view()

    def _view(self) -> StationView:
        return blind_view(self.scenario).model_copy(update={"safety": self.safety})

    def _journal(self, resumed: bool) -> Keeper:
        view = self._view().model_dump(mode="json")
        return Journal(self.folder, Head(view, resumed, self.key is not None))

    def kill(self) -> None:
        self.rig.node = Dead()  # type: ignore[assignment]

    def revive(self) -> None:
        resumed = resume(self.folder, self.key)
        assert resumed.differs is None
        for link in self.rig.station_links:
            link.receive()  # nobody kept these
        rig, journal = self.rig, self._journal(resumed=True)
        resumed.node.take_over(rig.station_links, rig.planner, [self.heard], journal)
        rig.node = resumed.node


def until(times: Iterator[float], end_s: float) -> None:
    for time_s in times:
        if time_s >= end_s:
            return


def scenario_of(name: str, *overrides: str) -> Scenario:
    return load_scenario(SCENARIOS / f"{name}.yaml", overrides)


@pytest.mark.parametrize(("name", "phase", "killed_s"), MOMENTS)
def test_killed_and_resumed_it_believes_the_same_and_finds_the_fault(
    name: str, phase: str, killed_s: float, tmp_path: Path
) -> None:
    bench = Bench(scenario_of(name), tmp_path)
    until(bench.times, killed_s)
    before = bench.rig.node.station.desk
    assert before.phase.name == phase
    bench.kill()
    until(bench.times, killed_s + DEAD_S)
    bench.revive()
    after = bench.rig.node.station.desk
    assert after is not before
    assert after.phase.name == phase
    assert after.alarmed == before.alarmed
    np.testing.assert_array_equal(after.watch.state, before.watch.state)
    if before.doubt is not None:
        np.testing.assert_array_equal(after.open_doubt.posterior, before.doubt.posterior)
        np.testing.assert_array_equal(after.open_doubt.states, before.doubt.states)
    run_until_ended(bench.rig, bench.times)
    verdict = bench.rig.node.station.desk.verdict
    assert verdict is not None
    assert (verdict.sysid, verdict.hypothesis, verdict.decided) == (2, RIGHT[name], True)
    assert any("in touch again" in text for text in bench.heard.texts("link"))


def test_what_was_given_back_before_it_died_is_the_station_s_again(tmp_path: Path) -> None:
    safety = Safety(allow_contact=True, fence_margin_m=0.0)
    bench = Bench(scenario_of("healthy"), tmp_path, safety=safety)
    until(bench.times, 6.0)
    bench.rig.vehicle(3).receive("gcs", Encoder(255, 190).set_mode(3, RoverMode.MANUAL))
    until(bench.times, 12.0)
    assert any("was taken over" in text for text in bench.heard.texts("takeover"))
    bench.rig.node.give_back()
    until(bench.times, 16.0)
    bench.kill()
    until(bench.times, 16.0 + DEAD_S)
    bench.revive()
    run_until_ended(bench.rig, bench.times)
    assert bench.heard.texts("end") == ["holding: no mission plan found"]  # scripted() has none
    assert len([text for text in bench.heard.texts("takeover") if "was taken" in text]) == 1


def test_killed_twice_with_signed_links(tmp_path: Path) -> None:
    key = key_of("a pass phrase")
    bench = Bench(scenario_of("rescue"), tmp_path, key)
    for at_s in (6.0, 14.0):
        until(bench.times, at_s)
        bench.kill()
        until(bench.times, at_s + DEAD_S)
        bench.revive()
    run_until_ended(bench.rig, bench.times)
    verdict = bench.rig.node.station.desk.verdict
    assert verdict is not None
    assert verdict.hypothesis == "motor_y_off"
    assert len(journal_files(tmp_path)) == 3
    with pytest.raises(InputError, match="--signing-key"):
        resume(tmp_path, None)


def test_the_journal_of_a_resumed_station_can_be_resumed_to_the_same(tmp_path: Path) -> None:
    bench = Bench(scenario_of("rescue"), tmp_path)
    until(bench.times, 6.0)
    bench.kill()
    until(bench.times, 6.0 + DEAD_S)
    bench.revive()
    until(bench.times, 20.0)
    ours = bench.rig.node.station.desk
    theirs = resume(tmp_path, None).node.station.desk
    assert theirs.phase.name == ours.phase.name
    np.testing.assert_array_equal(theirs.watch.state, ours.watch.state)
    steps = [r for r in read_journal(tmp_path) if isinstance(r, Inputs)]
    assert steps[-1].wall_s == pytest.approx(20.0, abs=0.1)


def test_a_station_that_waits_for_long_keeps_a_short_journal_and_then_does_its_work(
    tmp_path: Path,
) -> None:
    late = '[{"from_s": 0, "until_s": 15, "loss": 1.0}]'
    scenario = load_scenario(SCENARIOS / "rescue.yaml", [f"fleet.2.radio={late}"])
    view = blind_view(scenario)
    journal = Journal(tmp_path, Head(view.model_dump(mode="json")), long_bytes=20_000)
    rig, _, times = start(scenario, scripted(0.8), journal)
    until(times, 14.9)
    (file,) = journal_files(tmp_path)
    assert int(file.stem[-4:]) > 1
    assert file.stat().st_size < 25_000
    assert resume(tmp_path, None).node.station.desk.phase.name == "connect"
    run_until_ended(rig, times)
    ours = rig.node.station.desk
    assert ours.verdict is not None
    assert ours.verdict.hypothesis == RIGHT["rescue"]
    theirs = resume(tmp_path, None).node.station.desk
    assert theirs.verdict == ours.verdict
    np.testing.assert_array_equal(theirs.watch.state, ours.watch.state)


@pytest.mark.parametrize("name", ["healthy", "rescue"])
def test_a_starved_station_commands_nothing_stale_and_takes_nothing_for_a_fault(name: str) -> None:
    rig, heard, times = start(scenario_of(name), scripted(0.8))
    until(times, 4.1)  # in the middle of a pulse
    node, rig.node = rig.node, Dead()  # type: ignore[assignment]
    until(times, 9.1)
    rig.node = node
    sent = wiretap(rig)
    for time_s in times:
        if time_s >= 9.4:
            break
    assert sent
    assert not [m for m in decoded(sent) if isinstance(m, LocalSetpoint)]
    run_until_ended(rig, times)
    verdict = node.station.desk.verdict
    assert (verdict and verdict.hypothesis) == RIGHT.get(name)
    assert bool(heard.texts("anomaly")) == (name == "rescue")


def wiretap(rig: Rig) -> list[bytes]:
    """All that the station sends from now on."""
    sent: list[bytes] = []

    def tapped(send: object) -> object:
        def both(datagram: bytes) -> None:
            sent.append(datagram)
            send(datagram)  # type: ignore[operator]

        return both

    for link in rig.station_links:
        link.send = tapped(link.send)  # type: ignore[method-assign,assignment]
    return sent


def decoded(datagrams: list[bytes]) -> list[object]:
    decoder = Decoder()
    return [m.value for d in datagrams for m in decoder.decode(d)]
