"""The estimator: GPS, gyro and compass to position, velocity and heading.

One constant-velocity Kalman filter per NED axis, with acceleration as process noise. All axes see
the same noise at the same times, so they share one covariance. Without fixes the last velocity is
believed. Height and climb of what flies come from barometer and accelerometer alone, so that a GPS
that sticks or drifts can't fool them (ArduPilot Copter takes the climb from the GPS).
"""

import math
from dataclasses import dataclass

from hil.airframe import GRAVITY_MPS2
from hil.frames import wrap_pi
from hil.scenario import Sensors as Noise
from sim_vehicles.sensors import GpsFix, Inertial, Vector

ACCELERATION_SIGMA_MPS2 = 1.5
BARO_GAINS = 0.07, 0.0025  # alpha and beta: settles within a second at 50 Hz


@dataclass(frozen=True, slots=True)
class Estimate:
    """What the autopilot believes: NED (m, m/s), heading (rad, NED) and turn rate (rad/s)."""

    position_m: Vector
    velocity_mps: Vector
    yaw_rad: float
    gyro_radps: Vector
    roll_rad: float = 0.0
    pitch_rad: float = 0.0


class Estimator:
    """Feed it each step in order: `inertial`, then `gps` when there is a fix."""

    def __init__(self, noise: Noise, has_barometer: bool = False) -> None:
        self._gps_axes = 2 if has_barometer else 3
        self._position_variance = noise.gps_position_sigma_m**2 + noise.gps_wander_sigma_m**2
        self._velocity_variance = noise.gps_velocity_sigma_mps**2
        self._fixes_needed = noise.gps_hz  # one second of them
        self._fixes = 0
        self.fix_age_s = math.inf  # since the last fix
        self._level = (0.0, 0.0)
        self._axes: list[tuple[float, float]] = [(0.0, 0.0)] * 3  # position, velocity
        self._covariance = (1e6, 0.0, 1e2)  # pp, pv, vv
        self._gyro_variance = noise.gyro_sigma_radps**2
        self._compass_variance = noise.compass_sigma_rad**2
        self._yaw: float | None = None
        self._yaw_variance = self._compass_variance
        self._gyro: Vector = (0.0, 0.0, 0.0)

    @property
    def ready(self) -> bool:
        """True after a second of fixes."""
        return self._fixes >= self._fixes_needed

    def estimate(self) -> Estimate:
        (n, vn), (e, ve), (d, vd) = self._axes
        return Estimate((n, e, d), (vn, ve, vd), self._yaw or 0.0, self._gyro, *self._level)

    def inertial(self, sample: Inertial, dt_s: float) -> None:
        """Advance by dt and turn with the gyro; the compass corrects the heading."""
        self._gyro, self._level = sample.gyro_radps, sample.level_rad
        self.fix_age_s += dt_s
        if self._yaw is None:
            self._yaw = wrap_pi(sample.compass_rad)
        predicted = self._yaw + sample.gyro_radps[2] * dt_s
        variance = self._yaw_variance + self._gyro_variance * dt_s * dt_s
        gain = variance / (variance + self._compass_variance)
        self._yaw = wrap_pi(predicted + gain * wrap_pi(sample.compass_rad - predicted))
        self._yaw_variance = (1.0 - gain) * variance
        self._predict(dt_s)

    def barometer(self, down_m: float, sample: Inertial, dt_s: float) -> None:
        """Height and climb of what flies: accelerometer, corrected by barometer."""
        roll, pitch = sample.level_rad
        upright = math.cos(roll) * math.cos(pitch)
        gained_mps = (GRAVITY_MPS2 + sample.accel_mps2[2] * upright) * dt_s
        down, speed = self._axes[2][0], self._axes[2][1] + gained_mps
        innovation = down_m - down
        alpha, beta = BARO_GAINS
        self._axes[2] = (down + alpha * innovation, speed + beta * innovation / dt_s)

    def gps(self, fix: GpsFix) -> None:
        """Correct position and velocity; the first fix is taken as it is."""
        fixed = tuple(zip(fix.position_m, fix.velocity_mps, strict=True))
        self._fixes += 1
        self.fix_age_s = 0.0
        if self._fixes == 1:
            self._axes = [*fixed[: self._gps_axes], *self._axes[self._gps_axes :]]
            self._covariance = (self._position_variance, 0.0, self._velocity_variance)
            return
        pp, pv, vv = self._covariance
        # two scalar updates: position (gains kp, kv), then velocity (gains lp, lv)
        s = pp + self._position_variance
        kp, kv = pp / s, pv / s
        pp, pv, vv = pp - kp * pp, pv - kp * pv, vv - kv * pv
        s = vv + self._velocity_variance
        lp, lv = pv / s, vv / s
        self._covariance = (pp - lp * pv, pv - lp * vv, vv - lv * vv)
        for i in range(self._gps_axes):
            (p, v), (seen_p, seen_v) = self._axes[i], fixed[i]
            innovation = seen_p - p
            p, v = p + kp * innovation, v + kv * innovation
            innovation = seen_v - v
            self._axes[i] = (p + lp * innovation, v + lv * innovation)

    def _predict(self, dt: float) -> None:
        self._axes = [(p + v * dt, v) for p, v in self._axes]
        pp, pv, vv = self._covariance
        q = (ACCELERATION_SIGMA_MPS2 * dt) ** 2
        pp += 2.0 * dt * pv + dt * dt * vv + 0.25 * q * dt * dt
        self._covariance = (pp, pv + dt * vv + 0.5 * q * dt, vv + q)
