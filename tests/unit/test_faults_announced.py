"""Announced or silent: what a vehicle says of its own faults. What happens is the same."""

import dataclasses
import math

import pytest
from fault_vocabulary import EXAMPLES
from vehicle_world import InWorld, Velocity, scenario

from hil.faults import ANNOUNCE, KINDS, Fault, Type, Unit, to_clearing, to_injection
from hil.mavlink import (
    Command,
    EkfFlag,
    EkfStatus,
    EscTelemetry,
    FixType,
    GpsRaw,
    Message,
    MessageId,
    ParamValue,
    Sensor,
    Severity,
    StatusText,
    SysStatus,
)

NORTH: Velocity = (0.5, 0.0, 0.0)
PARTS = {
    Unit.MOTOR: ("Motor 1", "Motor 2"),
    Unit.ESC: ("ESC 1 telemetry",),
    Unit.GPS: ("GPS 1",),
    Unit.GYRO: ("Gyro 1",),
    Unit.ACCEL: ("Accel 1",),
}
BITS = {
    Unit.MOTOR: Sensor.MOTOR_OUTPUTS,
    Unit.ESC: Sensor(0),  # MAVLink has no bit for it
    Unit.GPS: Sensor.GPS,
    Unit.GYRO: Sensor.GYRO,
    Unit.ACCEL: Sensor.ACCEL,
}
ONCE_A_SECOND = (MessageId.EKF_STATUS_REPORT, MessageId.ESC_TELEMETRY_1_TO_4)


@pytest.fixture
def rover() -> InWorld:
    return driving()


def driving(airframe: str = "omni_plus") -> InWorld:
    world = InWorld(scenario(airframe, yaw="locked"))
    for number in ONCE_A_SECOND:
        world.tell(world.station.set_message_interval(1, number, 10.0))
    world.guided()
    world.run(2.0, {1: NORTH})
    return world


def broken(world: InWorld, fault: Fault, announced: bool) -> None:
    world.clear()
    world.inject(to_injection(fault, announced))
    world.run(3.0, {1: NORTH})


def last(world: InWorld, kind: type[Message]) -> Message:
    return world.sent(kind)[-1]


def ill(world: InWorld) -> Sensor:
    """The sensors that are there and not healthy."""
    status = world.sent(SysStatus)[-1]
    return Sensor(status.present & ~status.health)


def texts(world: InWorld) -> list[tuple[Severity, str]]:
    return [(t.severity, t.text) for t in world.sent(StatusText)]


@pytest.mark.parametrize("fault", EXAMPLES.values(), ids=lambda f: f"{f.unit.name} {f.type}")
def test_an_announced_fault_is_said_and_so_is_its_end(rover: InWorld, fault: Fault) -> None:
    broken(rover, fault, announced=True)
    failures = [(Severity.CRITICAL, f"{part}: failure") for part in PARTS[fault.unit]]
    assert [t for t in texts(rover) if t in failures] == failures
    assert BITS[fault.unit] in ill(rover)
    rover.clear()
    rover.inject(to_clearing(fault.unit))
    rover.run(3.0)
    again = [(Severity.INFO, f"{part}: healthy again") for part in PARTS[fault.unit]]
    assert [t for t in texts(rover) if t in again] == again
    assert ill(rover) == Sensor(0)


@pytest.mark.parametrize("fault", EXAMPLES.values(), ids=lambda f: f"{f.unit.name} {f.type}")
def test_announcing_changes_nothing_but_what_is_said(rover: InWorld, fault: Fault) -> None:
    silent = driving()
    broken(silent, fault, announced=False)
    broken(rover, fault, announced=True)
    assert rover.truth() == silent.truth()
    assert not any("failure" in text for _, text in texts(silent))
    quiet_too = Sensor.GPS | Sensor.AHRS | Sensor.PREARM_CHECK  # without fixes that shows anyway
    assert not ill(silent) & ~quiet_too
    assert not ill(silent) or fault.type in (Type.OFF, Type.INTERMITTENT)


def test_every_kind_has_an_example() -> None:
    assert EXAMPLES.keys() == KINDS.keys()


@pytest.mark.parametrize(
    ("kind", "size"), [(Type.OFF, ()), (Type.LOCKED, ()), (Type.PARTIAL, (0.5,))]
)
def test_the_controllers_of_an_announced_motor_report_what_it_gets(
    rover: InWorld, kind: Type, size: tuple[float, ...]
) -> None:
    sound = rover.sent(EscTelemetry)[-1].escs
    broken(rover, Fault(Unit.MOTOR, kind, (3,), size=size), announced=False)
    assert rover.sent(EscTelemetry)[-1].escs[0].rpm == pytest.approx(sound[0].rpm, rel=0.1)
    broken(rover, Fault(Unit.MOTOR, kind, (1,), size=size), announced=True)
    dead, other = rover.sent(EscTelemetry)[-1].escs[:2]
    share = size[0] if size else 0.0
    # one frame older than the command beside it
    assert dead.rpm == pytest.approx(share * other.rpm, rel=0.02)
    assert dead.current_a == pytest.approx(share * other.current_a, rel=0.02)
    assert other.rpm > 0


def test_a_rotor_too() -> None:
    quad = InWorld(scenario("quad_x"))
    quad.tell(quad.station.set_message_interval(1, MessageId.ESC_TELEMETRY_1_TO_4, 10.0))
    quad.guided()
    takeoff = quad.station.command_long(1, Command.NAV_TAKEOFF, 0, 0, 0, math.nan, 0, 0, 3.0)
    quad.tell(takeoff)
    quad.run(6.0)
    assert min(e.rpm for e in quad.sent(EscTelemetry)[-1].escs) > 500
    quad.inject(to_injection(Fault(Unit.MOTOR, Type.OFF, (2,)), announced=True))
    quad.run(0.3)
    rpms = [e.rpm for e in quad.sent(EscTelemetry)[-1].escs]
    assert rpms[1] == 0
    assert sum(rpms) > 1000


def test_an_announced_gps_fault_shows_in_fix_and_filter(rover: InWorld) -> None:
    offset = Fault(Unit.GPS, Type.OFFSET, size=(3.0, 0.0, 0.0))
    broken(rover, offset, announced=False)
    fix, ekf = rover.sent(GpsRaw)[-1], rover.sent(EkfStatus)[-1]
    assert (fix.fix_type, fix.satellites) == (FixType.RTK_FIXED, 18)
    assert EkfFlag.POS_HORIZ_ABS in EkfFlag(ekf.flags)
    assert EkfFlag.GPS_GLITCHING not in EkfFlag(ekf.flags)
    rover.inject(to_clearing(Unit.GPS))
    broken(rover, offset, announced=True)
    fix, ekf = rover.sent(GpsRaw)[-1], rover.sent(EkfStatus)[-1]
    assert (fix.fix_type, fix.satellites) == (FixType.FIX_3D, 4)
    assert fix.hdop > 5.0
    assert EkfFlag.POS_HORIZ_ABS not in EkfFlag(ekf.flags)
    assert EkfFlag.GPS_GLITCHING in EkfFlag(ekf.flags)
    rover.inject(to_clearing(Unit.GPS))
    rover.run(2.0)
    assert rover.sent(GpsRaw)[-1].fix_type == FixType.RTK_FIXED
    assert EkfFlag.GPS_GLITCHING not in EkfFlag(rover.sent(EkfStatus)[-1].flags)


def test_the_parameter_alone_says_nothing(rover: InWorld) -> None:
    rover.clear()
    rover.tell(rover.injector.param_set(1, ANNOUNCE, 1.0), 1, "injector")
    assert rover.sent(ParamValue, 1, "injector")[-1].value == 1.0
    rover.run(2.0, {1: NORTH})
    assert ill(rover) == Sensor(0)
    assert texts(rover) == []


def test_some_motors_may_tell_and_others_not(rover: InWorld) -> None:
    broken(rover, Fault(Unit.MOTOR, Type.OFF, (1,)), announced=True)
    broken(rover, Fault(Unit.MOTOR, Type.OFF, (2,)), announced=False)
    assert texts(rover) == []
    assert [e.rpm == 0 for e in rover.sent(EscTelemetry)[-1].escs[:2]] == [True, False]
    rover.inject(to_clearing(Unit.MOTOR, (1,)))
    rover.run(2.0)
    assert ill(rover) == Sensor(0)
    assert dataclasses.astuple(rover.sent(StatusText)[-1])[1] == "Motor 1: healthy again"
