"""The faults in effect in one vehicle, and what they do to its motors (pure).

`inject` is the state machine behind MAV_CMD_INJECT_FAILURE; sensors and motor outputs read the
result. Several faults of one unit are in effect together; type OK ends all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from hil.airframe import PWM_LOCKED_US, PWM_OFF_US, Airframe, clip_pwm
from hil.faults import ENGINE_LOCK, ENGINE_MUL, GPS_STUCK, FailureType, Unit

Vector = tuple[float, float, float]
Sizes = Mapping[str, float]
ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Gaps:
    """Comes and goes: each period begins with a gap that takes `share` of it."""

    since_s: float
    period_s: float
    share: float

    def missing(self, now_s: float) -> bool:
        # a microsecond of slack: both times are whole steps, their difference is not quite
        return (now_s - self.since_s + 1e-6) % self.period_s < self.share * self.period_s


@dataclass(frozen=True, slots=True)
class MotorDamage:
    """`gain` multiplies the output; `held` keeps the output that the motor had at onset."""

    off: bool = False
    locked: bool = False
    held: bool = False
    gain: float = 1.0
    gaps: Gaps | None = None


@dataclass(frozen=True, slots=True)
class EscDamage:
    """What is wrong with the telemetry of a speed controller, not with its motor."""

    off: bool = False
    gain: float = 1.0


@dataclass(frozen=True, slots=True)
class GpsDamage:
    """`stuck_mask` has bits N, E, D, and 8 for fixes repeated to the digit. Vectors are NED.

    `offset_m` jumps; `glitch_mps` moves position and velocity alike, `drift_mps` position alone.
    """

    off: bool = False
    stuck_mask: int = 0
    offset_m: Vector = ZERO
    glitch_mps: Vector = ZERO
    glitch_since_s: float = 0.0
    drift_mps: Vector = ZERO
    drift_since_s: float = 0.0
    noise_m: float = 0.0
    lag_s: float = 0.0
    gaps: Gaps | None = None

    def silent(self, now_s: float) -> bool:
        return self.off or (self.gaps is not None and self.gaps.missing(now_s))


@dataclass(frozen=True, slots=True)
class ImuDamage:
    """Bias (body axes) and standard deviation of extra white noise, in units of the sensor."""

    bias: Vector = ZERO
    noise: float = 0.0


@dataclass(frozen=True, slots=True)
class Damage:
    """All faults in effect."""

    motors: tuple[MotorDamage, ...]
    escs: tuple[EscDamage, ...]
    gps: GpsDamage = field(default_factory=GpsDamage)
    gyro: ImuDamage = field(default_factory=ImuDamage)
    accel: ImuDamage = field(default_factory=ImuDamage)

    @classmethod
    def none(cls, airframe: Airframe) -> "Damage":
        count = len(airframe.motors)
        return cls((MotorDamage(),) * count, (EscDamage(),) * count)


def inject(
    damage: Damage, unit: int, kind: int, instance: int, sizes: Sizes, now_s: float
) -> Damage | None:
    """The damage after one MAV_CMD_INJECT_FAILURE, or None when it can't be put in effect.

    `instance` counts from 1; 0 is all. `sizes` are the SIM_ parameters as they stand; a fault
    whose size makes it no fault can't be put in effect.
    """
    count = len(damage.motors)
    healthy = Damage((MotorDamage(),) * count, (EscDamage(),) * count)
    if kind != FailureType.OK and _after(healthy, unit, kind, instance, sizes, now_s) == healthy:
        return None
    return _after(damage, unit, kind, instance, sizes, now_s)


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


class MotorOutputs:
    """Between autopilot and motors: what the motors get of what was commanded, and reported."""

    def __init__(self, airframe: Airframe) -> None:
        self._airframe = airframe
        self._last: tuple[int, ...] = (PWM_OFF_US,) * len(airframe.motors)
        self._held: dict[int, int] = {}

    def broken(
        self, motors: Sequence[MotorDamage], pwm_us: tuple[int, ...], now_s: float
    ) -> tuple[int, ...]:
        """PWM (us) for the physics; channels beyond the motors pass."""
        out = tuple(self._one(i, m, pwm_us[i], now_s) for i, m in enumerate(motors))
        self._last = out
        return (*out, *pwm_us[len(out) :])

    def _one(self, i: int, motor: MotorDamage, pwm_us: int, now_s: float) -> int:
        if motor.held:
            pwm_us = self._held.setdefault(i, self._last[i])
        else:
            self._held.pop(i, None)
        if motor.locked:
            return PWM_LOCKED_US
        if motor.off or (motor.gaps is not None and motor.gaps.missing(now_s)):
            return PWM_OFF_US
        if motor.gain == 1.0 or pwm_us == PWM_OFF_US:
            return pwm_us
        zero_us = self._airframe.motors[i].zero_us
        return clip_pwm(round(zero_us + motor.gain * (pwm_us - zero_us)))
