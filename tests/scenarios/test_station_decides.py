"""The station against real vehicles in memory, with scripted plans: what it concludes, and when."""

import pytest

from hil.mavlink import Encoder, RoverMode
from hil.scenario import Safety, Scenario, load_scenario
from tests.conftest import SCENARIOS
from tests.scenarios.bench import run_until_ended, scripted, start


def _scenario(name: str, *overrides: str) -> Scenario:
    return load_scenario(SCENARIOS / f"{name}.yaml", overrides)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("name", "hypothesis"), [("rescue", "motor_y_off"), ("stuck_gps", "gps_east_stuck")]
)
def test_a_push_tells_dead_motors_from_a_stuck_gps(name: str, hypothesis: str, seed: int) -> None:
    rig, _, times = start(_scenario(name, f"seed={seed}"), scripted(0.8))
    run_until_ended(rig, times)
    verdict = rig.node.station.desk.verdict
    assert verdict is not None
    assert (verdict.sysid, verdict.hypothesis, verdict.decided) == (2, hypothesis, True)


@pytest.mark.parametrize(
    ("name", "hypothesis"), [("rescue", "motor_y_off"), ("stuck_gps", "gps_east_stuck")]
)
def test_who_applies_the_fault_is_the_same_to_the_station(name: str, hypothesis: str) -> None:
    rig, _, times = start(_scenario(name, "faults.0.applied_by=world"), scripted(0.8))
    run_until_ended(rig, times)
    verdict = rig.node.station.desk.verdict
    assert verdict is not None
    assert (verdict.sysid, verdict.hypothesis, verdict.decided) == (2, hypothesis, True)


def test_a_fault_that_ends_leaves_a_sound_vehicle() -> None:
    rig, heard, times = start(_scenario("rescue", "faults.0.until_s=0.5"), scripted(0.0))
    run_until_ended(rig, times)
    assert heard.texts("anomaly") == []


def test_a_manoeuvre_that_touches_nobody_decides_nothing_and_the_fleet_holds() -> None:
    rig, heard, times = start(_scenario("rescue"), scripted(-0.3, seconds=1.0))
    run_until_ended(rig, times)
    station = rig.node.station.desk
    assert station.verdict is not None
    assert not station.verdict.decided
    assert len(heard.texts("plan")) == 1 + station.view.diagnosis.tries  # alone, then with others
    assert any("cannot tell" in text for text in heard.texts("verdict"))
    assert all(t.status.mode == RoverMode.HOLD for t in station.fleet.tracks)


def test_a_healthy_fleet_raises_no_alarm_while_it_is_probed() -> None:
    for seed in range(3):
        rig, heard, times = start(_scenario("healthy", f"seed={seed}"), scripted(0.0))
        run_until_ended(rig, times)
        assert heard.texts("anomaly") == []
        assert rig.node.station.desk.verdict is None


def test_a_person_who_takes_over_keeps_the_vehicle() -> None:
    rig, heard, times = start(_scenario("rescue"), scripted(0.8))
    person = Encoder(255, 190)
    took_over_s = None
    for time_s in times:
        if took_over_s is None and time_s > 6.0:
            took_over_s = time_s
            rig.vehicle(3).receive("gcs", person.set_mode(3, RoverMode.MANUAL))
        if rig.node.finished:
            break
        assert time_s < 60.0
    assert any("rover_3" in text for text in heard.texts("takeover"))
    assert rig.node.station.desk.verdict is None
    assert rig.node.station.desk.fleet.tracks[2].status.mode == RoverMode.MANUAL
    assert rig.node.station.desk.fleet.tracks[0].status.mode == RoverMode.HOLD


def test_with_who_is_given_back_the_station_goes_on() -> None:
    """Where vehicles may be real the fleet waits for it, and does not go on before."""
    rig, heard, times = start(_scenario("healthy"), scripted(0.8))
    desk, person = rig.node.station.desk, Encoder(255, 190)
    safety = Safety(allow_contact=True, fence_margin_m=0.0)
    desk.view = desk.view.model_copy(update={"safety": safety})
    taken_s = back_s = None
    for time_s in times:
        if taken_s is None and time_s > 6.0:
            taken_s = time_s
            rig.vehicle(3).receive("gcs", person.set_mode(3, RoverMode.MANUAL))
        if taken_s is not None and back_s is None and time_s > taken_s + 10.0:
            back_s = time_s
            assert not desk.ended
            assert desk.fleet.tracks[2].status.mode == RoverMode.MANUAL
            rig.node.give_back()
        if rig.node.finished:
            break
        assert time_s < 200.0
    assert any("given back: rover_3" in text for text in heard.texts("takeover"))
    assert heard.texts("anomaly") == []
    assert heard.texts("end") == ["holding: no mission plan found"]  # scripted() has none


@pytest.mark.parametrize("when", ["rover_2.east_m > 99", "rover_2.north_m < -2.9"])
def test_a_fault_whose_condition_never_holds_is_never_found(when: str) -> None:
    fault = f"faults=[{{vehicle: 2, unit: motor, type: 'off', onset: {{when: '{when}'}}}}]"
    rig, heard, times = start(_scenario("rescue", fault), scripted(0.0))
    run_until_ended(rig, times)
    assert heard.texts("anomaly") == []


def test_the_same_seed_gives_the_same_events() -> None:
    def once() -> list[object]:
        rig, heard, times = start(_scenario("rescue", "seed=4"), scripted(0.8))
        run_until_ended(rig, times)
        return list(heard.events)

    assert once() == once()
