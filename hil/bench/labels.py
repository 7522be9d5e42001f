"""The name that the right verdict has, from the faults that really struck (pure)."""

from collections.abc import Sequence

from hil.airframe import Airframe
from hil.faults import Fault, Type, Unit

NONE, UNKNOWN = "none", "unknown"
CANNOT_TELL, NO_ALARM, WRONG_VEHICLE = "cannot tell", "no alarm", "wrong vehicle"

_MOTOR_KINDS = {
    Type.OFF: "off",
    Type.PARTIAL: "partial",
    Type.REVERSED: "reversed",
    Type.LOCKED: "locked",
}
_GPS_KINDS = {
    Type.OFFSET: "offset",
    Type.DRIFT: "drift",
    Type.DELAY: "delay",
    Type.NOISE: "noise",
}


def expected_hypothesis(faults: Sequence[Fault], frame: Airframe) -> str:
    """As in `motor_y_off`, `gps_east_stuck`, `gps_drift`, 'none'.

    Faults for which there is no such name, more than one kind at a time among them, are 'unknown'.
    """
    if not faults:
        return NONE
    kinds = {(f.unit, _real_type(f)) for f in faults}
    if len(kinds) > 1:
        return UNKNOWN
    ((unit, kind),) = kinds
    if unit is Unit.MOTOR and kind in _MOTOR_KINDS:
        return _motor_name(faults, kind, frame)
    if unit is Unit.GPS and kind is Type.STUCK:
        return _stuck_name(faults)
    if unit is Unit.GPS and kind is Type.REPEAT:
        return "gps_stuck"
    if unit is Unit.GPS and kind in _GPS_KINDS:
        return f"gps_{_GPS_KINDS[kind]}"
    return UNKNOWN


def _real_type(fault: Fault) -> Type:
    """A motor of which nothing is left is off."""
    if fault.type is Type.PARTIAL and fault.size[0] == 0.0:
        return Type.OFF
    return fault.type


def _motor_name(faults: Sequence[Fault], kind: Type, frame: Airframe) -> str:
    if len({f.size for f in faults}) > 1:
        return UNKNOWN
    every = range(1, len(frame.motors) + 1)
    broken = {i for f in faults for i in f.instances or every}
    axes = [a for a in ("x", "y") if broken == set(frame.axis_motors(a))]
    return f"motor_{axes[0]}_{_MOTOR_KINDS[kind]}" if len(axes) == 1 else UNKNOWN


def _stuck_name(faults: Sequence[Fault]) -> str:
    axes = {a for f in faults for a in f.axes or ("north", "east")} - {"down"}
    if axes == {"north", "east"}:
        return "gps_stuck"
    return f"gps_{axes.pop()}_stuck" if axes else UNKNOWN
