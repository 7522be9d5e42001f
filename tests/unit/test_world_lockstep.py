"""Lockstep: frames in, answers out, repeats dropped, the silent named."""

from hypothesis import given
from hypothesis import strategies as st

from hil.physics_link import ServoFrame, decode_state, encode_frame, pad_channels
from hil.scenario import Scenario
from hil.world.lockstep import RESEND_AFTER_S, SILENT_AFTER_S, Lockstep
from hil.world.simulation import Simulation

HOLD = pad_channels((1500,) * 4)


def frame(count: int, rate_hz: int = 50) -> ServoFrame:
    return ServoFrame(rate_hz, count, HOLD)


def joined(*sysids: int) -> Lockstep:
    lockstep = Lockstep(sysids, 200)
    for sysid in sysids:
        lockstep.receive(sysid, frame(0), 0, 0.0)
    return lockstep


def test_nobody_there_means_no_step() -> None:
    lockstep = Lockstep((1, 2), 200)
    assert lockstep.absent() == (1, 2)
    assert not lockstep.may_step()


def test_steps_only_when_every_frame_is_in() -> None:
    lockstep = joined(1, 2)
    assert lockstep.may_step()
    lockstep.answered(1, b"r", 0.0)
    assert lockstep.waiting_for() == (1,)
    lockstep.receive(1, frame(1), 4, 0.1)
    assert lockstep.may_step()


def test_a_slow_frame_holds_for_its_own_period() -> None:
    lockstep = Lockstep((1, 2), 200)
    lockstep.receive(1, frame(0, rate_hz=50), 0, 0.0)
    lockstep.receive(2, frame(0, rate_hz=200), 0, 0.0)
    assert lockstep.next_answer() == 1
    assert lockstep.answers_due(1) == (2,)
    assert lockstep.answers_due(4) == (1, 2)


def test_a_rate_that_does_not_divide_gets_one_step_a_frame() -> None:
    for rate_hz in (60, 400, 1200):
        lockstep = Lockstep((1,), 200)
        lockstep.receive(1, frame(0, rate_hz), 0, 0.0)
        assert lockstep.next_answer() == 1


def test_repeats_of_an_unanswered_frame_are_dropped() -> None:
    lockstep = joined(1)
    assert lockstep.receive(1, frame(0), 0, 1.0) is None
    assert lockstep.next_answer() == 4


def test_a_lost_reply_is_sent_again_but_not_at_once() -> None:
    lockstep = joined(1)
    lockstep.answered(1, b"reply", 10.0)
    assert lockstep.receive(1, frame(0), 4, 10.0 + RESEND_AFTER_S) is None
    assert lockstep.receive(1, frame(0), 4, 10.1 + RESEND_AFTER_S) == b"reply"
    assert lockstep.receive(1, frame(0), 4, 10.2 + RESEND_AFTER_S) is None
    assert lockstep.waiting_for() == (1,)


def test_late_duplicates_change_nothing() -> None:
    lockstep = joined(1)
    for count in (1, 2):
        lockstep.answered(1, b"r", float(count))
        lockstep.receive(1, frame(count), 4 * count, float(count))
    assert lockstep.receive(1, frame(1), 8, 9.0) is None
    assert lockstep.next_answer() == 12


def test_frame_zero_rejoins() -> None:
    lockstep = joined(1)
    lockstep.answered(1, b"r", 1.0)
    lockstep.receive(1, frame(1), 4, 1.0)
    lockstep.receive(1, frame(0), 6, 2.0)
    assert lockstep.next_answer() == 10


def test_the_silent_are_named_only_while_the_world_waits_for_them() -> None:
    lockstep = joined(1, 2)
    assert lockstep.silent(100.0) == ()
    lockstep.answered(1, b"r", 100.0)
    assert lockstep.silent(100.0 + SILENT_AFTER_S) == ()
    assert lockstep.silent(100.1 + SILENT_AFTER_S) == (1,)


def test_a_lost_vehicle_has_no_power_until_it_comes_back() -> None:
    lockstep = joined(1, 2)
    lockstep.answered(1, b"r", 0.0)
    lockstep.lose(1)
    assert lockstep.may_step()
    assert set(lockstep.outputs()) == {2}
    lockstep.receive(1, frame(0), 50, 5.0)
    lockstep.receive(1, frame(1), 50, 5.0)
    assert set(lockstep.outputs()) == {1, 2}


def test_a_world_whose_vehicles_are_all_lost_waits() -> None:
    lockstep = joined(1)
    lockstep.answered(1, b"r", 0.0)
    lockstep.lose(1)
    assert not lockstep.may_step()


def two_rovers() -> Scenario:
    point = {"north_m": 0.0, "east_m": 0.0}
    fleet = [
        {"name": f"r{i}", "sysid": i, "start": {"north_m": 0.0, "east_m": float(i)}, "goal": point}
        for i in (1, 2)
    ]
    arena = {"north_min_m": -5, "north_max_m": 5, "east_min_m": -5, "east_max_m": 5}
    return Scenario.model_validate({"name": "two", "arena": arena, "fleet": fleet})


def test_mixed_rates_in_one_world() -> None:
    """A vehicle at 50 Hz and one at 200 Hz: each is answered at its own frame times."""
    simulation = Simulation(two_rovers(), 0)
    rates, counts = {1: 50, 2: 200}, {1: 0, 2: 0}
    answers: dict[int, list[float]] = {1: [], 2: []}
    for sysid in rates:
        simulation.receive(sysid, [encode_frame(frame(0, rates[sysid]))], 0.0)
    while simulation.time_s < 0.1:
        for sysid, reply in simulation.advance(0.1, 0.0).replies:
            state = decode_state(reply)
            assert state is not None
            answers[sysid].append(state.time_s)
            counts[sysid] += 1
            simulation.receive(sysid, [encode_frame(frame(counts[sysid], rates[sysid]))], 0.0)
    assert answers[1] == [0.02, 0.04, 0.06, 0.08, 0.1]
    assert answers[2] == [i / 200 for i in range(1, 21)]


def test_the_leash_may_end_inside_a_frame() -> None:
    simulation = Simulation(two_rovers(), 0)
    for sysid in (1, 2):
        simulation.receive(sysid, [encode_frame(frame(0))], 0.0)
    assert simulation.advance(0.0101, 0.0).replies == ()
    assert simulation.time_s == 0.01
    assert len(simulation.advance(1.0, 0.0).replies) == 2
    assert simulation.time_s == 0.02


@given(st.floats(0.0, 0.1, allow_nan=False))
def test_who_may_step_does_and_who_may_not_does_not(until_s: float) -> None:
    """A world that believes it may step and then does not would spin for ever."""
    simulation = Simulation(two_rovers(), 0)
    count = 0
    while simulation.lockstep.waiting_for() or count == 0:
        for sysid in (1, 2):
            simulation.receive(sysid, [encode_frame(frame(count))], 0.0)
        count += 1
        while simulation.may_step(until_s):
            before = simulation.world.steps
            simulation.advance(until_s, 0.0)
            assert simulation.world.steps > before
        if not simulation.lockstep.waiting_for():
            break
    assert until_s - 1 / 200 <= simulation.time_s <= until_s + 1e-6


def test_truth_comes_at_ten_hertz_from_zero_on() -> None:
    simulation = Simulation(two_rovers(), 0)
    times: list[float] = []
    for count in range(51):
        for sysid in (1, 2):
            simulation.receive(sysid, [encode_frame(frame(count))], 0.0)
        times += [t.time_s for t in simulation.advance(1.0, 0.0).truth]
        if simulation.time_s >= 1.0:
            break
    assert times == [i / 10 for i in range(11)]
