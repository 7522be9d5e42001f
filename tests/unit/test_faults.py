"""The vocabulary of faults: what goes over MAVLink, and what is refused in words."""

import pytest
from pymavlink.dialects.v20 import all as dialect

from hil.faults import (
    ANNOUNCE,
    GATE,
    KINDS,
    FailureType,
    Fault,
    Type,
    Unit,
    default_sizes,
    refusal,
    size_parameters,
    to_clearing,
    to_injection,
)
from hil.mavlink import Command


def sized(unit: Unit, kind: Type) -> Fault:
    """The fault with the largest sizes it can have."""
    sizes = KINDS[unit, kind].sizes
    return Fault(unit, kind, size=tuple(s.high / s.scale for s in sizes))


def test_numbers_are_mavlinks() -> None:
    """pymavlink ends before ESC telemetry (106) and drift (8), which are newer."""
    units, types = dialect.enums["FAILURE_UNIT"], dialect.enums["FAILURE_TYPE"]
    assert units[Unit.MOTOR].name == "FAILURE_UNIT_SYSTEM_MOTOR"
    assert units[Unit.GPS].name == "FAILURE_UNIT_SENSOR_GPS"
    assert units[Unit.GYRO].name == "FAILURE_UNIT_SENSOR_GYRO"
    assert units[Unit.ACCEL].name == "FAILURE_UNIT_SENSOR_ACCEL"
    assert Command.INJECT_FAILURE == dialect.MAV_CMD_INJECT_FAILURE
    for kind in FailureType:
        if kind is not FailureType.DRIFT:
            assert types[kind].name == f"FAILURE_TYPE_{kind.name}"


@pytest.mark.parametrize(("unit", "kind"), KINDS)
def test_every_fault_says_itself_whole(unit: Unit, kind: Type) -> None:
    injection = to_injection(sized(unit, kind))
    assert injection.parameters[0] == (GATE, 1.0)
    known = {GATE, *default_sizes()}
    assert {name for name, _ in injection.parameters} <= known
    assert injection.commands == ((unit, KINDS[unit, kind].failure_type, 0),)


def test_no_two_faults_are_the_same_orders() -> None:
    orders = [to_injection(sized(unit, kind)) for unit, kind in KINDS]
    assert len(set(orders)) == len(orders)


def test_parameter_names_fit_and_defaults_break_nothing_twice() -> None:
    names = [ANNOUNCE, *(size.parameter for _, size in size_parameters())]
    assert len(set(names)) == len(names)
    assert all(len(name) <= 16 for name in names)


def test_instances_axes_and_sizes_travel() -> None:
    motors = to_injection(Fault(Unit.MOTOR, Type.PARTIAL, (2, 4), size=(0.25,)))
    assert motors.parameters == ((GATE, 1.0), ("SIM_ENGINE_MUL", 0.25), (ANNOUNCE, 0.0))
    assert motors.commands == ((101, 4, 2), (101, 4, 4))
    stuck = to_injection(Fault(Unit.GPS, Type.STUCK, axes=("north", "down")))
    assert stuck.parameters == ((GATE, 1.0), ("SIM_GPS1_STUCK", 5.0), (ANNOUNCE, 0.0))
    assert to_injection(Fault(Unit.ESC, Type.OFF), announced=True).parameters[-1] == (ANNOUNCE, 1.0)
    delay = to_injection(Fault(Unit.GPS, Type.DELAY, size=(0.5,)))
    assert delay.parameters[1] == ("SIM_GPS1_LAG_MS", 500.0)
    assert to_clearing(Unit.MOTOR, (3,)).commands == ((101, 0, 3),)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (Fault(Unit.MOTOR, Type.BIAS), "no injector for motor bias; for this unit there are off"),
        (Fault(Unit.GPS, Type.OFFSET, size=(1.0,)), "gps offset has 1 sizes; it takes 3"),
        (Fault(Unit.MOTOR, Type.OFF, size=(1.0,)), "it takes 0: none"),
        (Fault(Unit.MOTOR, Type.PARTIAL, size=(1.5,)), "must be 0 to 1"),
        (Fault(Unit.GPS, Type.DELAY, size=(11.0,)), "must be 0 to 10 s"),
        (Fault(Unit.GPS, Type.NOISE, size=(float("nan"),)), "must be 0 to 1000 m"),
    ],
)
def test_what_cannot_be_is_refused_in_words(fault: Fault, words: str) -> None:
    assert words in (refusal(fault) or "")
