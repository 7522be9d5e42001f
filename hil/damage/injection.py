"""What MAV_CMD_INJECT_FAILURE does to the faults in effect (pure).

Several faults of one unit are in effect together; type OK ends all of them.
"""

from collections.abc import Mapping
from dataclasses import replace

from hil.damage.state import (
    ZERO,
    Damage,
    EscDamage,
    Gaps,
    GpsDamage,
    ImuDamage,
    MotorDamage,
    Vector,
)
from hil.faults import (
    ANNOUNCE,
    ENGINE_LOCK,
    ENGINE_MUL,
    GPS_STUCK,
    FailureType,
    Injection,
    Unit,
    default_sizes,
)

Sizes = Mapping[str, float]


def inject(
    damage: Damage, unit: int, kind: int, instance: int, sizes: Sizes, now_s: float
) -> Damage | None:
    """The damage after one MAV_CMD_INJECT_FAILURE, or None when it can't be put in effect.

    `instance` counts from 1; 0 is all. `sizes` are the SIM_ parameters as they stand (each of
    `default_sizes`); a fault whose size makes it no fault can't be put in effect.
    """
    count = len(damage.motors)
    healthy = Damage((MotorDamage(),) * count, (EscDamage(),) * count)
    if kind != FailureType.OK and _after(healthy, unit, kind, instance, sizes, now_s) == healthy:
        return None
    after = _after(damage, unit, kind, instance, sizes, now_s)
    if after is None or kind == FailureType.OK or not sizes[ANNOUNCE]:
        return after
    return _announced(after, Unit(unit), instance)


def struck(damage: Damage, injection: Injection, now_s: float) -> Damage | None:
    """The damage after a whole injection; None when a part of it can't be put in effect."""
    sizes = default_sizes() | dict(injection.parameters)
    after: Damage | None = damage
    for unit, kind, instance in injection.commands:
        after = after and inject(after, unit, kind, instance, sizes, now_s)
    return after


def _announced(damage: Damage, unit: Unit, instance: int) -> Damage:
    def chosen(i: int) -> bool:
        return instance in (0, i + 1)

    motors, escs = damage.motors, damage.escs
    match unit:
        case Unit.MOTOR:
            told = (replace(m, announced=m.announced or chosen(i)) for i, m in enumerate(motors))
            return replace(damage, motors=tuple(told))
        case Unit.ESC:
            said = (replace(e, announced=e.announced or chosen(i)) for i, e in enumerate(escs))
            return replace(damage, escs=tuple(said))
        case Unit.GPS:
            return replace(damage, gps=replace(damage.gps, announced=True))
        case Unit.GYRO:
            return replace(damage, gyro=replace(damage.gyro, announced=True))
        case Unit.ACCEL:
            return replace(damage, accel=replace(damage.accel, announced=True))


def _after(
    damage: Damage, unit: int, kind: int, instance: int, sizes: Sizes, now_s: float
) -> Damage | None:
    if unit in (Unit.MOTOR, Unit.ESC):
        if not 0 <= instance <= len(damage.motors):
            return None
        return _inject_motors(damage, Unit(unit), kind, instance, sizes, now_s)
    if instance not in (0, 1):
        return None
    if unit == Unit.GPS:
        gps = _gps(damage.gps, kind, sizes, now_s)
        return replace(damage, gps=gps) if gps else None
    if unit == Unit.GYRO:
        gyro = _imu(damage.gyro, kind, sizes, "SIM_GYR1")
        return replace(damage, gyro=gyro) if gyro else None
    if unit == Unit.ACCEL:
        accel = _imu(damage.accel, kind, sizes, "SIM_ACC1")
        return replace(damage, accel=accel) if accel else None
    return None


def _inject_motors(
    damage: Damage, unit: Unit, kind: int, instance: int, sizes: Sizes, now_s: float
) -> Damage | None:
    chosen = range(len(damage.motors)) if instance == 0 else (instance - 1,)
    if unit is Unit.ESC:
        escs = {i: _esc(damage.escs[i], kind, sizes) for i in chosen}
        if None in escs.values():
            return None
        return replace(damage, escs=tuple(escs.get(i) or e for i, e in enumerate(damage.escs)))
    motors = {i: _motor(damage.motors[i], kind, sizes, now_s) for i in chosen}
    if None in motors.values():
        return None
    return replace(damage, motors=tuple(motors.get(i) or m for i, m in enumerate(damage.motors)))


def _motor(motor: MotorDamage, kind: int, sizes: Sizes, now_s: float) -> MotorDamage | None:
    if kind == FailureType.OFF:
        locked = sizes[ENGINE_LOCK] != 0.0
        return replace(motor, off=not locked, locked=locked)
    if kind == FailureType.WRONG:
        return replace(motor, gain=sizes[ENGINE_MUL])
    if kind == FailureType.STUCK:
        return replace(motor, held=True)
    if kind == FailureType.INTERMITTENT:
        return replace(motor, gaps=_gaps(sizes, "SIM_ENGINE", now_s))
    return MotorDamage() if kind == FailureType.OK else None


def _esc(esc: EscDamage, kind: int, sizes: Sizes) -> EscDamage | None:
    if kind == FailureType.OFF:
        return replace(esc, off=True)
    if kind == FailureType.WRONG:
        return replace(esc, gain=sizes["SIM_ESC_MUL"])
    return EscDamage() if kind == FailureType.OK else None


def _gps(gps: GpsDamage, kind: int, sizes: Sizes, now_s: float) -> GpsDamage | None:
    if kind == FailureType.OFF:
        return replace(gps, off=True)
    if kind == FailureType.STUCK:
        return replace(gps, stuck_mask=int(sizes[GPS_STUCK]) or 7)
    if kind == FailureType.WRONG:
        glitch = _vector(sizes, "SIM_GPS1_GLTV", "NED")
        offset = _vector(sizes, "SIM_GPS1_OFS", "NED")
        since_s = now_s if glitch != ZERO else 0.0
        return replace(gps, offset_m=offset, glitch_mps=glitch, glitch_since_s=since_s)
    if kind == FailureType.DRIFT:
        drift = _vector(sizes, "SIM_GPS1_DRIFT", "NED")
        since_s = now_s if drift != ZERO else 0.0
        return replace(gps, drift_mps=drift, drift_since_s=since_s)
    if kind == FailureType.GARBAGE:
        return replace(gps, noise_m=sizes["SIM_GPS1_NOISE"])
    if kind == FailureType.DELAYED:
        return replace(gps, lag_s=sizes["SIM_GPS1_LAG_MS"] / 1e3)
    if kind == FailureType.INTERMITTENT:
        return replace(gps, gaps=_gaps(sizes, "SIM_GPS1", now_s))
    return GpsDamage() if kind == FailureType.OK else None


def _imu(imu: ImuDamage, kind: int, sizes: Sizes, prefix: str) -> ImuDamage | None:
    if kind == FailureType.WRONG:
        return replace(imu, bias=_vector(sizes, f"{prefix}_BIAS", "XYZ"))
    if kind == FailureType.GARBAGE:
        return replace(imu, noise=sizes[f"{prefix}_NOISE"])
    return ImuDamage() if kind == FailureType.OK else None


def _vector(sizes: Sizes, prefix: str, axes: str) -> Vector:
    first, second, third = (sizes[f"{prefix}_{axis}"] for axis in axes)
    return first, second, third


def _gaps(sizes: Sizes, prefix: str, now_s: float) -> Gaps | None:
    share = sizes[f"{prefix}_GAP"]
    return Gaps(now_s, sizes[f"{prefix}_CYCLE"], share) if share > 0.0 else None
