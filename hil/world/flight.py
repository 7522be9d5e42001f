"""What the plane leaves out of a body that flies: height and tilt (pure).

Tilt is a rotation vector with body x and y parts, over a body that yaws in the plane: exact for a
turn about one axis, which small tilts and a fall over one side both are. Legs hold the attitude
while they carry weight.
"""

import math
from dataclasses import dataclass

from hil.airframe import GRAVITY_MPS2, Airframe, Lift
from hil.frames import body_to_ned, ned_to_body

Pair = tuple[float, float]
Vector = tuple[float, float, float]
TOPPLED_RAD = math.radians(60.0)  # touching the ground beyond this tilt, it stays as it lies


@dataclass(frozen=True)
class Air:
    """Height (down, m and m/s), tilt (rad) and tilt rates (rad/s); pairs are body x and y."""

    down_m: float = 0.0
    down_mps: float = 0.0
    tilt_rad: Pair = (0.0, 0.0)
    rates_radps: Pair = (0.0, 0.0)

    @property
    def downwards(self) -> Vector:
        """The body's z axis: ahead, right, down in a level frame of the same heading."""
        a, b = self.tilt_rad
        angle = math.hypot(a, b)
        k = math.sin(angle) / angle if angle > 0.0 else 1.0
        return k * b, -k * a, math.cos(angle)

    @property
    def roll_rad(self) -> float:
        """Euler angle (z-y-x)."""
        return math.asin(max(-1.0, min(1.0, -self.downwards[1])))

    @property
    def pitch_rad(self) -> float:
        """Euler angle (z-y-x), over the whole circle."""
        ahead, _, down = self.downwards
        return math.atan2(ahead, down)

    @property
    def toppled(self) -> bool:
        return self.downwards[2] < math.cos(TOPPLED_RAD)


def thrust_ned(air: Air, yaw_rad: float, thrust_n: float) -> Vector:
    """The rotors' thrust (N), which points up in the body, in NED."""
    ahead, right, down = air.downwards
    north, east = body_to_ned(ahead, right, yaw_rad)
    return -thrust_n * north, -thrust_n * east, -thrust_n * down


def in_body(vector: Vector, air: Air, yaw_rad: float) -> Vector:
    """A NED vector in body axes (x forward, y right, z down)."""
    cr, sr = math.cos(air.roll_rad), math.sin(air.roll_rad)
    cp, sp = math.cos(air.pitch_rad), math.sin(air.pitch_rad)
    n, e, d = vector
    forward, right = ned_to_body(n, e, yaw_rad)
    return (
        cp * forward - sp * d,
        sr * sp * forward + cr * right + sr * cp * d,
        cr * sp * forward - sr * right + cr * cp * d,
    )


def load_n(frame: Airframe, air: Air, down_force_n: float) -> float:
    """What the ground carries (N); `down_force_n` is all but weight. 0 in the air."""
    return max(0.0, frame.weight_n + down_force_n) if air.down_m >= 0.0 else 0.0


def step(frame: Airframe, air: Air, lift: Lift, down_force_n: float, dt_s: float) -> Air:
    """One step of height and tilt. Touching the ground ends all of that motion."""
    if load_n(frame, air, down_force_n) > 0.0:
        return _landed(air)
    down_mps = air.down_mps + (GRAVITY_MPS2 + down_force_n / frame.mass_kg) * dt_s
    down_m = air.down_m + down_mps * dt_s
    (a, b), (p, q) = air.tilt_rad, air.rates_radps
    p = _turned(frame, p, lift.roll_nm, dt_s)
    q = _turned(frame, q, lift.pitch_nm, dt_s)
    moved = Air(down_m, down_mps, (a + p * dt_s, b + q * dt_s), (p, q))
    return _landed(moved) if down_m > 0.0 else moved


def _turned(frame: Airframe, rate_radps: float, torque_nm: float, dt_s: float) -> float:
    if frame.flight is None:
        return 0.0
    torque_nm -= frame.flight.tilt_damping_nms * rate_radps
    return rate_radps + torque_nm / frame.flight.tilt_inertia_kgm2 * dt_s


def _landed(air: Air) -> Air:
    return Air(tilt_rad=air.tilt_rad) if air.toppled else Air()
