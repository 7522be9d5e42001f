"""The faults in effect in one vehicle, as values (pure).

A fault that is `announced` changes what the vehicle says of its health, and nothing else.
"""

from dataclasses import dataclass, field

from hil.airframe import Airframe

Vector = tuple[float, float, float]
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
    announced: bool = False


@dataclass(frozen=True, slots=True)
class EscDamage:
    """What is wrong with the telemetry of a speed controller, not with its motor."""

    off: bool = False
    gain: float = 1.0
    announced: bool = False


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
    announced: bool = False

    def silent(self, now_s: float) -> bool:
        return self.off or (self.gaps is not None and self.gaps.missing(now_s))


@dataclass(frozen=True, slots=True)
class ImuDamage:
    """Bias (body axes) and standard deviation of extra white noise, in units of the sensor."""

    bias: Vector = ZERO
    noise: float = 0.0
    announced: bool = False


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
