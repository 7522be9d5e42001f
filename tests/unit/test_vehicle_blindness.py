"""Nothing readable on the station's port tells the fault."""

import pytest
from vehicle_harness import Harness

from hil.faults import GATE, default_sizes
from hil.mavlink import (
    Command,
    CommandAck,
    MessageId,
    ParamFailed,
    ParamRequestRead,
    ParamValue,
    Result,
    ServoOutputs,
    StatusText,
)
from hil.scenario import Scenario

FAULTS = {
    "y motors off": [(101, 1, 3), (101, 1, 4)],
    "all motors off": [(101, 1, 0)],
    "all motors stuck at their outputs": [(101, 2, 0)],
    "all motors intermittent": [(101, 7, 0)],
    "GPS stuck": [(4, 2, 0)],
}


def interviewed(scenario: Scenario, injections: list[tuple[int, int, int]]) -> list[bytes]:
    """All bytes on the station's port of a vehicle at rest that is asked everything."""
    rover = Harness(scenario)
    for numbers in injections:
        rover.inject(*numbers)
    rover.run(2.0)
    rover.tell(rover.station.param_request_list(2))
    rover.tell(rover.station.param_set(2, "SIM_GPS1_STUCK", 1.0))
    for number in range(500):
        rover.tell(rover.station.request_message(2, number))
    rover.tell(rover.station.arm(2))
    rover.tell(rover.station.set_mode(2, 15))
    rover.run(3.0)
    return rover.datagrams["gcs"]


@pytest.mark.parametrize("fault", FAULTS)
def test_every_byte_is_the_same_with_and_without_a_fault(rescue: Scenario, fault: str) -> None:
    assert interviewed(rescue, FAULTS[fault]) == interviewed(rescue, [])


def test_outputs_asked_for_between_steps_are_those_before_the_fault(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.inject(101, 1, 0)
    rover.guided()
    rover.run(1.0, (0.5, 0.5))
    assert rover.pwm == (0,) * 16
    rover.tell(rover.station.request_message(2, MessageId.SERVO_OUTPUT_RAW))
    (outputs,) = rover.values(ServoOutputs)
    assert min(outputs.pwm_us[:4]) > 1600


def test_injection_does_not_exist_on_the_stations_port(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.station.inject_failure(2, 101, 1, 3))
    assert [a.result for a in rover.values(CommandAck)] == [Result.UNSUPPORTED]
    rover.guided()
    rover.run(2.0, (0.0, 0.5))
    assert rover.pwm[2] > 1600


def test_sim_parameters_do_not_exist_on_the_stations_port(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.station.param_request_list(2))
    assert not [p for p in rover.values(ParamValue) if p.name.startswith("SIM_")]
    rover.tell(rover.station.encode(ParamRequestRead(2, 1, "SIM_GPS1_STUCK")))
    assert len(rover.values(ParamFailed)) == 1
    assert rover.values(ParamValue) == []


def test_the_injector_sees_them(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.injector.param_request_list(2), "injector")
    names = [p.name for p in rover.values(ParamValue, "injector")]
    assert names == sorted([GATE, *default_sizes()])
    rover.tell(rover.injector.param_set(2, "SIM_GPS1_STUCK", 3.0), "injector")
    assert [p.value for p in rover.values(ParamValue, "injector")] == [3.0]
    assert rover.datagrams["gcs"] == []


def test_acks_and_texts_of_an_injection_stay_on_its_port(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.inject(101, 1, 3)
    assert [a.result for a in rover.values(CommandAck, "injector")] == [Result.ACCEPTED]
    assert rover.values(StatusText, "injector")
    assert rover.datagrams["gcs"] == []


@pytest.mark.parametrize(
    ("numbers", "result"),
    [
        ((101, 1, 5), Result.DENIED),  # there are four motors
        ((101, 1, -1), Result.DENIED),
        ((4, 2, 2), Result.DENIED),  # there is one GPS
        ((101, 5, 1), Result.UNSUPPORTED),  # a motor can't be slow
        ((3, 1, 0), Result.UNSUPPORTED),  # there is no barometer
        ((0, 1, 0), Result.UNSUPPORTED),
        ((101, 4, 1), Result.DENIED),  # SIM_ENGINE_MUL is 1: that would break nothing
        ((4, 8, 1), Result.DENIED),  # no drift speed is set
        ((4, 1, 0), Result.ACCEPTED),
        ((101, 0, 0), Result.ACCEPTED),
    ],
)
def test_the_ack_says_only_what_is_in_effect(
    rescue: Scenario, numbers: tuple[int, int, int], result: Result
) -> None:
    rover = Harness(rescue)
    rover.inject(*numbers)
    assert [a.result for a in rover.values(CommandAck, "injector")] == [result]


def test_the_gate_is_shut_until_it_is_opened(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.injector.inject_failure(2, 101, 1, 3), "injector")
    assert [a.result for a in rover.values(CommandAck, "injector")] == [Result.DENIED]
    assert [t.text for t in rover.values(StatusText, "injector")] == [f"Failure: {GATE} is 0"]
    rover.guided()
    rover.run(1.0, (0.0, 0.5))
    assert rover.pwm[2] > 1600


def test_instances_as_a_bit_mask(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.injector.param_set(2, GATE, 1.0), "injector")
    mask = (101.0, 1.0, float("nan"), 0b1100)
    command = rover.injector.command_long(2, Command.INJECT_FAILURE, *mask)
    rover.tell(command, "injector")
    assert [a.result for a in rover.values(CommandAck, "injector")] == [Result.ACCEPTED]
    rover.guided()
    rover.run(0.1, (0.5, 0.5))
    assert [p > 0 for p in rover.pwm[:4]] == [True, True, False, False]


def test_the_station_cannot_be_asked_from_the_injectors_port(rescue: Scenario) -> None:
    """Nothing crosses: modes and set-points are the station's."""
    rover = Harness(rescue)
    rover.run(1.5)
    rover.tell(rover.injector.arm(2), "injector")
    assert [a.result for a in rover.values(CommandAck, "injector")] == [Result.UNSUPPORTED]
