"""What the plane leaves out of a body that flies: height and tilt (pure).

Attitude is roll and pitch about a body that yaws in the plane, with small-angle kinematics: exact
near level, and good enough to fall over. Legs hold the attitude while they carry weight.
"""

import math
from dataclasses import dataclass

from hil.airframe import GRAVITY_MPS2, Airframe, Lift

Vector = tuple[float, float, float]
TOPPLED_RAD = math.radians(60.0)  # touching the ground beyond this tilt, it stays as it lies


@dataclass(frozen=True)
class Air:
    """Height (down, m and m/s), tilt (rad) and tilt rates (rad/s, body)."""

    down_m: float = 0.0
    down_mps: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rate_radps: float = 0.0
    pitch_rate_radps: float = 0.0

    @property
    def toppled(self) -> bool:
        return math.cos(self.roll_rad) * math.cos(self.pitch_rad) < math.cos(TOPPLED_RAD)


def thrust_ned(air: Air, yaw_rad: float, thrust_n: float) -> Vector:
    """The rotors' thrust (N), which points up in the body, in NED."""
    cr, sr = math.cos(air.roll_rad), math.sin(air.roll_rad)
    cp, sp = math.cos(air.pitch_rad), math.sin(air.pitch_rad)
    cy, sy = math.cos(yaw_rad), math.sin(yaw_rad)
    return (
        -thrust_n * (cr * sp * cy + sr * sy),
        -thrust_n * (cr * sp * sy - sr * cy),
        -thrust_n * cr * cp,
    )


def in_body(vector: Vector, air: Air, yaw_rad: float) -> Vector:
    """A NED vector in body axes (x forward, y right, z down)."""
    cr, sr = math.cos(air.roll_rad), math.sin(air.roll_rad)
    cp, sp = math.cos(air.pitch_rad), math.sin(air.pitch_rad)
    cy, sy = math.cos(yaw_rad), math.sin(yaw_rad)
    n, e, d = vector
    forward, right = cy * n + sy * e, cy * e - sy * n
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
    p = _turned(frame, air.roll_rate_radps, lift.roll_nm, dt_s)
    q = _turned(frame, air.pitch_rate_radps, lift.pitch_nm, dt_s)
    moved = Air(down_m, down_mps, air.roll_rad + p * dt_s, air.pitch_rad + q * dt_s, p, q)
    return _landed(moved) if down_m > 0.0 else moved


def _turned(frame: Airframe, rate_radps: float, torque_nm: float, dt_s: float) -> float:
    if frame.flight is None:
        return 0.0
    torque_nm -= frame.flight.tilt_damping_nms * rate_radps
    return rate_radps + torque_nm / frame.flight.tilt_inertia_kgm2 * dt_s


def _landed(air: Air) -> Air:
    return Air(roll_rad=air.roll_rad, pitch_rad=air.pitch_rad) if air.toppled else Air()
