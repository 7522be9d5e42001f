"""Injection: orders of a fault over MAVLink, repeated until confirmed; and when faults strike."""

from typing import Any

import pytest
from bench_builders import rescue

from hil.bench.injector import ANSWER_WITHIN_S, RESEND_S, Breaker
from hil.bench.onsets import Onsets, parse_condition
from hil.errors import InputError, ProcessDiedError
from hil.faults import ANNOUNCE, ENGINE_LOCK, GATE
from hil.mavlink import (
    COMPONENT_AUTOPILOT,
    Command,
    CommandAck,
    CommandLong,
    Decoder,
    Encoder,
    Message,
    ParamFailed,
    ParamSet,
    ParamValue,
    Result,
)
from hil.scenario import FaultModel, Scenario
from hil.world.orders import Break, Mend
from hil.world.truth import TruthRecord, VehicleTruth

STUCK = FaultModel(vehicle=2, unit="gps", type="stuck", axes=("east",))
OFF = FaultModel(vehicle=2, unit="motor", type="off", instances=(3, 4))
VEHICLE = Encoder(2, COMPONENT_AUTOPILOT)


def sent(datagrams: list[bytes]) -> list[Any]:
    return [r.value for d in datagrams for r in Decoder().decode(d)]


def answer(message: Message, sender: Encoder = VEHICLE) -> list[bytes]:
    return [sender.encode(message)]


def ack(result: int = Result.ACCEPTED) -> CommandAck:
    return CommandAck(Command.INJECT_FAILURE, result, 251, 190)


@pytest.fixture
def struck() -> list[FaultModel]:
    return []


@pytest.fixture
def mended() -> list[FaultModel]:
    return []


@pytest.fixture
def to_world() -> list[Break | Mend]:
    return []


@pytest.fixture
def breaker(
    struck: list[FaultModel], mended: list[FaultModel], to_world: list[Break | Mend]
) -> Breaker:
    return Breaker(rescue(), struck.append, mended.append, to_world.append)


def test_nothing_asked_nothing_sent(breaker: Breaker) -> None:
    assert breaker.done
    assert breaker.step(0.0, 2, []) == []


def test_each_motor_is_a_command_of_its_own(breaker: Breaker, struck: list[FaultModel]) -> None:
    breaker.strike([OFF])
    breaker.step(0.0, 2, [])
    breaker.step(0.0, 2, answer(ParamValue(GATE, 1.0, 0, 2)))
    breaker.step(0.0, 2, answer(ParamValue(ENGINE_LOCK, 0.0, 1, 2)))
    (first,) = sent(breaker.step(0.0, 2, answer(ParamValue(ANNOUNCE, 0.0, 1, 2))))
    assert isinstance(first, CommandLong)
    assert (first.command, first.params[:3]) == (420, (101.0, 1.0, 3.0))
    (second,) = sent(breaker.step(0.1, 2, answer(ack())))
    assert second.params[:3] == (101.0, 1.0, 4.0)
    assert struck == []
    assert breaker.step(0.2, 2, answer(ack())) == []
    assert struck == [OFF]
    assert breaker.done


def test_parameters_go_before_commands(breaker: Breaker, struck: list[FaultModel]) -> None:
    breaker.strike([STUCK])
    (gate,) = sent(breaker.step(0.0, 2, []))
    assert (gate.name, gate.value) == (GATE, 1.0)
    (first,) = sent(breaker.step(0.0, 2, answer(ParamValue(GATE, 1.0, 0, 2))))
    assert isinstance(first, ParamSet)
    assert (first.name, first.value) == ("SIM_GPS1_STUCK", 2.0)
    (second,) = sent(breaker.step(0.1, 2, answer(ParamValue("SIM_GPS1_STUCK", 2.0, 0, 1))))
    assert (second.name, second.value) == (ANNOUNCE, 0.0)
    (third,) = sent(breaker.step(0.1, 2, answer(ParamValue(ANNOUNCE, 0.0, 0, 1))))
    assert third.params[:3] == (4.0, 2.0, 0.0)
    breaker.step(0.2, 2, answer(ack()))
    assert struck == [STUCK]


def test_a_fault_ends_when_its_clearing_is_confirmed(
    breaker: Breaker, struck: list[FaultModel], mended: list[FaultModel]
) -> None:
    breaker.mend([STUCK])
    breaker.step(0.0, 2, [])
    (clearing,) = sent(breaker.step(0.0, 2, answer(ParamValue(GATE, 1.0, 0, 2))))
    assert clearing.params[:3] == (4.0, 0.0, 0.0)
    assert mended == []
    breaker.step(0.1, 2, answer(ack()))
    assert (struck, mended) == ([], [STUCK])


def test_what_the_world_applies_goes_to_no_vehicle(
    breaker: Breaker,
    struck: list[FaultModel],
    mended: list[FaultModel],
    to_world: list[Break | Mend],
) -> None:
    fault = OFF.model_copy(update={"applied_by": "world"})
    breaker.strike([fault])
    assert (struck, mended, to_world) == ([fault], [], [Break(fault)])
    breaker.mend([fault])
    assert (mended, to_world) == ([fault], [Break(fault), Mend(fault)])
    assert breaker.done
    assert [breaker.step(0.0, sysid, []) for sysid in (1, 2, 3)] == [[], [], []]


def test_a_fault_may_be_announced(breaker: Breaker) -> None:
    breaker.strike([STUCK.model_copy(update={"announced": True})])
    breaker.step(0.0, 2, [])
    breaker.step(0.0, 2, answer(ParamValue(GATE, 1.0, 0, 2)))
    (told,) = sent(breaker.step(0.1, 2, answer(ParamValue("SIM_GPS1_STUCK", 2.0, 0, 1))))
    assert (told.name, told.value) == (ANNOUNCE, 1.0)


def test_an_order_is_repeated_until_it_is_answered(breaker: Breaker) -> None:
    breaker.strike([OFF])
    times = [0.0, 0.1, RESEND_S, RESEND_S + 0.1, 2 * RESEND_S]
    counts = [len(breaker.step(t, 2, [])) for t in times]
    assert counts == [1, 0, 1, 0, 1]


@pytest.mark.parametrize(
    "noise",
    [
        answer(CommandAck(Command.DO_SET_MODE, Result.ACCEPTED, 251, 190)),
        answer(ack(), sender=Encoder(1, COMPONENT_AUTOPILOT)),
        answer(ack(Result.IN_PROGRESS)),
        answer(ParamValue("SYSID_THISMAV", 2.0, 0, 1)),
        [b"", b"\xfd" * 30],
    ],
    ids=["another command", "another vehicle", "in progress", "another parameter", "garbage"],
)
def test_other_messages_confirm_nothing(breaker: Breaker, noise: list[bytes]) -> None:
    breaker.strike([OFF])
    breaker.step(0.0, 2, [])
    assert breaker.step(0.1, 2, noise) == []
    assert not breaker.done


@pytest.mark.parametrize(
    ("fault", "refusal", "words"),
    [
        (OFF, ack(Result.UNSUPPORTED), "unit 101, type 1, instance 3"),
        (STUCK, ParamFailed(251, 190, "SIM_GPS1_STUCK", -1, 1), "SIM_GPS1_STUCK"),
        (STUCK, ParamValue("SIM_GPS1_STUCK", 0.0, 0, 1), "stays 0 instead of 2"),
    ],
    ids=["command", "parameter error", "parameter kept"],
)
def test_a_refusal_is_named(
    breaker: Breaker, fault: FaultModel, refusal: Message, words: str
) -> None:
    breaker.strike([fault])
    breaker.step(0.0, 2, [])
    orders = ((GATE, 1.0), (ENGINE_LOCK, 0.0), (ANNOUNCE, 0.0))
    for name, value in orders[: 3 if fault is OFF else 1]:
        breaker.step(0.0, 2, answer(ParamValue(name, value, 0, 2)))
    with pytest.raises(InputError, match="rover_2 refuses") as error:
        breaker.step(0.1, 2, answer(refusal))
    assert words in str(error.value)


def test_a_vehicle_that_never_answers_is_named(breaker: Breaker) -> None:
    breaker.strike([OFF])
    breaker.step(0.0, 2, [])
    with pytest.raises(ProcessDiedError, match="rover_2 does not answer"):
        breaker.step(ANSWER_WITHIN_S + 1.0, 2, [])


def scenario(*onsets: dict[str, Any]) -> Scenario:
    fault = {"vehicle": 2, "unit": "motor", "type": "off"}
    tree = rescue().model_dump()
    faults = [{**fault, "instances": [i + 1], "onset": o} for i, o in enumerate(onsets)]
    return Scenario.model_validate(tree | {"faults": faults})


def truth(time_s: float, north_m: float = 0.0, speed_mps: float = 0.0) -> TruthRecord:
    body = VehicleTruth(north_m, 0.0, 0.0, speed_mps, 0.0)
    return TruthRecord(time_s, {1: body, 2: body, 3: body})


def instances(faults: tuple[FaultModel, ...]) -> list[int]:
    return [f.instances[0] for f in faults]


def test_faults_strike_once_in_their_time() -> None:
    onsets = Onsets(scenario({"at_s": 0.0}, {"at_s": 2.0}, {"when": "rover_2.north_m > 1.5"}))
    assert instances(onsets.at_start()) == [1]
    assert instances(onsets.due(truth(1.9))) == []
    assert instances(onsets.due(truth(2.0))) == [2]
    assert instances(onsets.due(truth(2.1, north_m=1.6))) == [3]
    assert onsets.due(truth(9.0, north_m=9.0)) == ()


def test_faults_end_in_their_time_if_they_ever_struck() -> None:
    plain = scenario({"at_s": 0.0}, {"at_s": 2.0}, {"when": "rover_2.north_m > 1.5"})
    faults = tuple(f.model_copy(update={"until_s": 3.0}) for f in plain.faults)
    onsets = Onsets(plain.model_copy(update={"faults": faults}))
    onsets.at_start()
    assert instances(onsets.over(truth(2.9))) == []
    assert instances(onsets.due(truth(2.9))) == [2]
    assert instances(onsets.over(truth(3.0))) == [1, 2]
    assert onsets.over(truth(3.1)) == ()
    assert onsets.due(truth(3.1, north_m=9.0)) == ()


@pytest.mark.parametrize(
    ("when", "holds"),
    [
        ("rover_2.goal_distance_m < 2.1", True),  # the goal is at (3, 1.5)
        ("rover_2.goal_distance_m<2", False),
        ("rover_2.speed_mps > 0.4", True),
        ("rover_2.east_m < -0.1", False),
    ],
)
def test_conditions(when: str, holds: bool) -> None:
    onsets = Onsets(scenario({"when": when}))
    assert bool(onsets.due(truth(0.0, north_m=1.6, speed_mps=0.5))) is holds


@pytest.mark.parametrize("text", ["rover_9.north_m > 1", "rover_2.north_m > 1.2.3", "later"])
def test_unreadable_conditions_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"onset\.when"):
        parse_condition(rescue(), text)
