"""Faults as data: unit x type x instance x size, to and from MAVLink (pure).

Source of the numbers: MAV_CMD_INJECT_FAILURE (420), enums FAILURE_UNIT and FAILURE_TYPE. The
command has no field for size or axis, so those travel first, as SIM_* parameters.
"""

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Self


class Unit(IntEnum):
    """FAILURE_UNIT, the part of it this testbed can break."""

    GPS = 4
    MOTOR = 101


class Type(IntEnum):
    """FAILURE_TYPE, the part of it this testbed can do."""

    OK = 0
    OFF = 1
    STUCK = 2


NED_AXES = ("north", "east", "down")


@dataclass(frozen=True)
class Fault:
    """One broken unit. `instances` count from 1, as MAVLink does; empty means all of them.

    `axes` names the NED axes that a stuck GPS freezes (SIM_GPS1_STUCK, bits 0 N, 1 E, 2 D).
    """

    unit: Unit
    type: Type
    instances: tuple[int, ...] = ()
    axes: tuple[str, ...] = ()

    @property
    def axes_mask(self) -> int:
        return sum(1 << NED_AXES.index(a) for a in self.axes)


SUPPORTED = frozenset({(Unit.MOTOR, Type.OFF), (Unit.GPS, Type.STUCK)})


@dataclass(frozen=True)
class Injection:
    """What goes over the injector's link: parameters first, then one command per instance."""

    parameters: tuple[tuple[str, float], ...]
    commands: tuple[tuple[int, int, int], ...]  # (unit, type, instance) of MAV_CMD_INJECT_FAILURE


def to_injection(fault: Fault) -> Injection:
    """The MAVLink way to make `fault` happen."""
    parameters: tuple[tuple[str, float], ...] = ()
    if fault.unit is Unit.GPS and fault.type is Type.STUCK:
        parameters = (("SIM_GPS1_STUCK", float(fault.axes_mask or 0b111)),)
    commands = tuple((int(fault.unit), int(fault.type), i) for i in fault.instances or (0,))
    return Injection(parameters, commands)


@dataclass(frozen=True)
class ActiveFaults:
    """All faults in effect in one vehicle: the state that injection commands change."""

    motors_off: frozenset[int] = frozenset()  # instances from 1
    gps_stuck_mask: int = 0  # bits N, E, D

    def apply(
        self, unit: int, failure_type: int, instance: int, motor_count: int, stuck_mask: int
    ) -> Self | None:
        """The faults after one MAV_CMD_INJECT_FAILURE, or None when it can't be put in effect.

        `instance` 0 means all. `stuck_mask` is SIM_GPS1_STUCK as it stands (0: all axes).
        """
        if unit == Unit.MOTOR:
            if not 0 <= instance <= motor_count:
                return None
            chosen = frozenset(range(1, motor_count + 1) if instance == 0 else (instance,))
            if failure_type == Type.OFF:
                return replace(self, motors_off=self.motors_off | chosen)
            if failure_type == Type.OK:
                return replace(self, motors_off=self.motors_off - chosen)
        if unit == Unit.GPS and instance in (0, 1):
            if failure_type == Type.STUCK:
                return replace(self, gps_stuck_mask=stuck_mask or 0b111)
            if failure_type == Type.OK:
                return replace(self, gps_stuck_mask=0)
        return None
