"""Faults as data: unit x type x instance x size, to MAVLink (pure).

MAV_CMD_INJECT_FAILURE (420) names unit, type and instance. It has no field for a size, so sizes
travel first, as SIM_* parameters; where MAVLink has one type for two of ours, a parameter tells
them apart. Both are injected only after the gate is open, as MAVLink asks.
"""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

GATE = "SYS_FAILURE_EN"  # PX4's name; 0 (default) refuses every injection
ANNOUNCE = "SIM_FAIL_TELL"  # ours; 1: the vehicle notices, and says so; 0 (default): silent
NED_AXES = ("north", "east", "down")


class Unit(IntEnum):
    """FAILURE_UNIT, the part of it this testbed can break. pymavlink 2.4.50 ends before ESC."""

    GYRO = 0
    ACCEL = 1
    GPS = 4
    MOTOR = 101
    ESC = 106


class FailureType(IntEnum):
    """FAILURE_TYPE. pymavlink 2.4.50 ends before DRIFT."""

    OK = 0
    OFF = 1
    STUCK = 2
    GARBAGE = 3
    WRONG = 4
    SLOW = 5
    DELAYED = 6
    INTERMITTENT = 7
    DRIFT = 8


class Type(StrEnum):
    """What can go wrong, by the names a scenario uses."""

    OFF = "off"
    LOCKED = "locked"
    PARTIAL = "partial"
    REVERSED = "reversed"
    STUCK = "stuck"
    INTERMITTENT = "intermittent"
    REPEAT = "repeat"
    OFFSET = "offset"
    DRIFT = "drift"
    GLITCH = "glitch"
    NOISE = "noise"
    DELAY = "delay"
    BIAS = "bias"
    WRONG = "wrong"


@dataclass(frozen=True)
class Size:
    """One number of a fault and the parameter that carries it, in `scale` parts of `unit`."""

    parameter: str
    unit: str
    low: float
    high: float
    scale: float = 1.0
    default: float = 0.0


@dataclass(frozen=True)
class Kind:
    """How MAVLink says a fault. `fixed` tells it from others of the same unit and type."""

    failure_type: FailureType
    sizes: tuple[Size, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()


ENGINE_LOCK, ENGINE_MUL, GPS_STUCK = "SIM_ENGINE_LOCK", "SIM_ENGINE_MUL", "SIM_GPS1_STUCK"
REPEAT_BIT = 8  # of SIM_GPS1_STUCK: the last fix comes again, to the digit


def _vector(prefix: str, axes: str, unit: str, limit: float) -> tuple[Size, ...]:
    return tuple(Size(f"{prefix}_{axis}", unit, -limit, limit) for axis in axes)


def _gaps(prefix: str) -> tuple[Size, ...]:
    """A period that begins with a gap, and the gap's share of it."""
    period = Size(f"{prefix}_CYCLE", "s", 0.03125, 600.0, default=2.0)
    return period, Size(f"{prefix}_GAP", "", 0.0, 1.0, default=0.5)


_MUL = Size(ENGINE_MUL, "", -1.0, 1.0, default=1.0)
_OFF, _WRONG = FailureType.OFF, FailureType.WRONG

KINDS: dict[tuple[Unit, Type], Kind] = {
    (Unit.MOTOR, Type.OFF): Kind(_OFF, fixed=((ENGINE_LOCK, 0.0),)),
    (Unit.MOTOR, Type.LOCKED): Kind(_OFF, fixed=((ENGINE_LOCK, 1.0),)),
    (Unit.MOTOR, Type.PARTIAL): Kind(_WRONG, (Size(ENGINE_MUL, "", 0.0, 1.0),)),
    (Unit.MOTOR, Type.REVERSED): Kind(_WRONG, fixed=((ENGINE_MUL, -1.0),)),
    (Unit.MOTOR, Type.STUCK): Kind(FailureType.STUCK),
    (Unit.MOTOR, Type.INTERMITTENT): Kind(FailureType.INTERMITTENT, _gaps("SIM_ENGINE")),
    (Unit.ESC, Type.OFF): Kind(_OFF),
    (Unit.ESC, Type.WRONG): Kind(_WRONG, (Size("SIM_ESC_MUL", "", -10.0, 10.0, default=1.0),)),
    (Unit.GPS, Type.OFF): Kind(_OFF),
    (Unit.GPS, Type.STUCK): Kind(FailureType.STUCK),  # SIM_GPS1_STUCK follows from the axes
    (Unit.GPS, Type.REPEAT): Kind(FailureType.STUCK, fixed=((GPS_STUCK, float(REPEAT_BIT | 7)),)),
    (Unit.GPS, Type.OFFSET): Kind(_WRONG, _vector("SIM_GPS1_OFS", "NED", "m", 1e4)),
    (Unit.GPS, Type.GLITCH): Kind(_WRONG, _vector("SIM_GPS1_GLTV", "NED", "m/s", 100.0)),
    (Unit.GPS, Type.DRIFT): Kind(FailureType.DRIFT, _vector("SIM_GPS1_DRIFT", "NED", "m/s", 100.0)),
    (Unit.GPS, Type.NOISE): Kind(FailureType.GARBAGE, (Size("SIM_GPS1_NOISE", "m", 0.0, 1e3),)),
    (Unit.GPS, Type.DELAY): Kind(
        FailureType.DELAYED, (Size("SIM_GPS1_LAG_MS", "s", 0.0, 1e4, scale=1e3),)
    ),
    (Unit.GPS, Type.INTERMITTENT): Kind(FailureType.INTERMITTENT, _gaps("SIM_GPS1")),
    (Unit.GYRO, Type.BIAS): Kind(_WRONG, _vector("SIM_GYR1_BIAS", "XYZ", "rad/s", 10.0)),
    (Unit.GYRO, Type.NOISE): Kind(
        FailureType.GARBAGE, (Size("SIM_GYR1_NOISE", "rad/s", 0.0, 10.0),)
    ),
    (Unit.ACCEL, Type.BIAS): Kind(_WRONG, _vector("SIM_ACC1_BIAS", "XYZ", "m/s2", 50.0)),
    (Unit.ACCEL, Type.NOISE): Kind(
        FailureType.GARBAGE, (Size("SIM_ACC1_NOISE", "m/s2", 0.0, 50.0),)
    ),
}

SUPPORTED = frozenset(KINDS)

# What the world can do to motor outputs on their way in, and to a position on its way out.
WORLD_KINDS = (
    *((unit, kind) for unit, kind in KINDS if unit is Unit.MOTOR),
    *((Unit.GPS, t) for t in (Type.STUCK, Type.OFFSET, Type.GLITCH, Type.DRIFT, Type.DELAY)),
)


@dataclass(frozen=True)
class Fault:
    """One broken unit. `instances` count from 1, as MAVLink does; empty means all of them.

    `axes` names the NED axes that a stuck GPS freezes (SIM_GPS1_STUCK, bits 0 N, 1 E, 2 D).
    `size` is in the units of `KINDS`: a fraction, a duration, or a vector in NED or body axes.
    """

    unit: Unit
    type: Type
    instances: tuple[int, ...] = ()
    axes: tuple[str, ...] = ()
    size: tuple[float, ...] = ()

    @property
    def axes_mask(self) -> int:
        return sum(1 << NED_AXES.index(a) for a in self.axes)


def refusal(fault: Fault) -> str | None:
    """Why a fault can't be injected as it stands, in words for people; None when it can."""
    kind = KINDS.get((fault.unit, fault.type))
    name = f"{fault.unit.name.lower()} {fault.type}"
    if kind is None:
        known = ", ".join(t for u, t in KINDS if u is fault.unit)
        return f"no injector for {name}; for this unit there are {known}"
    if len(fault.size) != len(kind.sizes):
        wanted = ", ".join(_described(s) for s in kind.sizes) or "none"
        return f"{name} has {len(fault.size)} sizes; it takes {len(kind.sizes)}: {wanted}"
    for value, size in zip(fault.size, kind.sizes, strict=True):
        if not size.low <= value * size.scale <= size.high:
            return f"{name} has size {value:g}; it must be {_described(size)}"
    return None


def _described(size: Size) -> str:
    low, high = size.low / size.scale, size.high / size.scale
    return f"{low:g} to {high:g} {size.unit}".strip()


@dataclass(frozen=True)
class Injection:
    """What goes over the injector's link: parameters first, then one command per instance."""

    parameters: tuple[tuple[str, float], ...]
    commands: tuple[tuple[int, int, int], ...]  # (unit, type, instance) of MAV_CMD_INJECT_FAILURE


def to_injection(fault: Fault, announced: bool = False) -> Injection:
    """The MAVLink way to make `fault` happen: all of it, the gate included."""
    kind = KINDS[fault.unit, fault.type]
    sizes = zip(kind.sizes, fault.size, strict=True)
    parameters = (
        (GATE, 1.0),
        *(((GPS_STUCK, float(fault.axes_mask or 7)),) if _is_stuck_gps(fault) else ()),
        *kind.fixed,
        *((size.parameter, value * size.scale) for size, value in sizes),
        (ANNOUNCE, float(announced)),
    )
    number = int(kind.failure_type)
    commands = tuple((int(fault.unit), number, i) for i in fault.instances or (0,))
    return Injection(parameters, commands)


def to_clearing(unit: Unit, instances: tuple[int, ...] = ()) -> Injection:
    """The MAVLink way to repair a unit: type OK, which also puts its sizes back."""
    commands = tuple((int(unit), int(FailureType.OK), i) for i in instances or (0,))
    return Injection(((GATE, 1.0),), commands)


def _is_stuck_gps(fault: Fault) -> bool:
    return (fault.unit, fault.type) == (Unit.GPS, Type.STUCK)


def size_parameters() -> tuple[tuple[Unit, Size], ...]:
    """Every parameter that carries a size or selects a kind, with the unit it belongs to."""
    own = (
        (Unit.MOTOR, Size(ENGINE_LOCK, "", 0.0, 1.0)),
        (Unit.MOTOR, _MUL),
        (Unit.GPS, Size(GPS_STUCK, "", 0.0, 15.0)),
    )
    named = {size.parameter for _, size in own}
    carried = {s.parameter: (u, s) for (u, _), k in KINDS.items() for s in k.sizes}
    return own + tuple(pair for name, pair in carried.items() if name not in named)


def default_sizes() -> dict[str, float]:
    """Every parameter that an injection reads, as it stands before any is set."""
    return {ANNOUNCE: 0.0} | {size.parameter: size.default for _, size in size_parameters()}
