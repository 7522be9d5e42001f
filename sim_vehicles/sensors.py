"""Sensors: what the physics state looks like through noise, and through faults.

The draws never depend on faults, so the same seed gives the same noise with and without one: what
a fault adds comes from streams of their own, which are drawn from whether or not it is in effect.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hil.airframe import GRAVITY_MPS2
from hil.damage import GpsDamage, GpsMeans, ImuDamage
from hil.faults import REPEAT_BIT
from hil.physics_link import PhysicsState
from hil.scenario import Sensors as Noise

Vector = tuple[float, float, float]
_GYRO_STREAM, _GPS_STREAM = 0x4759524F, 0x475053
_ACCEL_STREAM, _IMU_EXTRA_STREAM, _GPS_EXTRA_STREAM = 0x4143434C, 0x494D5558, 0x47505358
_BARO_STREAM = 0x4241524F
_BLOCK = 256
BARO_SIGMA_M = 0.1  # chosen; of one sample, 50 a second
_WHOLE = GpsDamage()
_SOUND = ImuDamage()


@dataclass(frozen=True, slots=True)
class Inertial:
    """Each autopilot step: gyro (body, rad/s), compass heading (rad), specific force, levels.

    `level_rad` is roll and pitch, as a levelled attitude filter gives them.
    """

    gyro_radps: Vector
    compass_rad: float
    accel_mps2: Vector = (0.0, 0.0, -GRAVITY_MPS2)
    level_rad: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True)
class GpsFix:
    """A GPS position and Doppler velocity, NED from the origin."""

    time_s: float
    position_m: Vector
    velocity_mps: Vector


def noise_rows(seed: tuple[int, ...], width: int) -> Iterator[list[float]]:
    """Rows of `width` standard normal numbers for ever; drawn in blocks, which is cheap."""
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    while True:
        yield from rng.standard_normal((_BLOCK, width)).tolist()


class InertialSensors:
    """White noise on gyro, accelerometer, compass and levels."""

    def __init__(self, noise: Noise, seed: int, sysid: int) -> None:
        self._gyro_sigma, self._compass_sigma = noise.gyro_sigma_radps, noise.compass_sigma_rad
        self._accel_sigma, self._level_sigma = noise.accel_sigma_mps2, noise.level_sigma_rad
        self._rows = noise_rows((seed, sysid, _GYRO_STREAM), 4)
        self._accel_rows = noise_rows((seed, sysid, _ACCEL_STREAM), 5)
        self._extra_rows = noise_rows((seed, sysid, _IMU_EXTRA_STREAM), 6)

    def sample(
        self, state: PhysicsState, gyro: ImuDamage = _SOUND, accel: ImuDamage = _SOUND
    ) -> Inertial:
        z, a, extra = next(self._rows), next(self._accel_rows), next(self._extra_rows)
        roll, pitch, yaw = state.attitude_rad
        return Inertial(
            _measured(state.gyro_radps, self._gyro_sigma, z, gyro, extra),
            yaw + self._compass_sigma * z[3],
            _measured(state.accel_body_mps2, self._accel_sigma, a, accel, extra[3:]),
            (roll + self._level_sigma * a[3], pitch + self._level_sigma * a[4]),
        )


def _measured(
    truth: Vector, sigma: float, z: list[float], damage: ImuDamage, extra: list[float]
) -> Vector:
    x, y, w = (t + sigma * n for t, n in zip(truth, z, strict=False))
    if damage is _SOUND or damage == _SOUND:
        return x, y, w
    (bx, by, bw), k = damage.bias, damage.noise
    return x + bx + k * extra[0], y + by + k * extra[1], w + bw + k * extra[2]


class Gps:
    """White noise plus a slow wander (Gauss-Markov) on position; white noise on Doppler velocity.

    A stuck axis freezes the mean it had at onset, of position and velocity both, and keeps the
    noise: the fault can't be told from the noise of a vehicle at rest.
    """

    def __init__(self, noise: Noise, seed: int, sysid: int) -> None:
        self._noise = noise
        self._period_s = 1.0 / noise.gps_hz
        self._due_s = 0.0
        self._rows = noise_rows((seed, sysid, _GPS_STREAM), 9)
        self._extra_rows = noise_rows((seed, sysid, _GPS_EXTRA_STREAM), 3)
        self._keep = math.exp(-self._period_s / noise.gps_wander_time_s)
        self._kick_m = noise.gps_wander_sigma_m * math.sqrt(1.0 - self._keep**2)
        self._wander_m = [noise.gps_wander_sigma_m * z for z in next(self._rows)[:3]]
        self._means = GpsMeans()
        self._last: GpsFix | None = None

    def sample(self, state: PhysicsState, damage: GpsDamage = _WHOLE) -> GpsFix | None:
        """The fix at this step if one is due, and the receiver gives it."""
        means = self._means.at(state, damage)
        if state.time_s + 1e-6 < self._due_s:
            return None
        self._due_s = (math.floor(state.time_s / self._period_s + 1e-6) + 1) * self._period_s
        fix = self._noisy(state.time_s, means, damage.noise_m)
        if damage.stuck_mask & REPEAT_BIT and self._last is not None:
            fix = replace(self._last, time_s=state.time_s)
        if damage.silent(state.time_s):
            return None
        self._last = fix
        return fix

    def _noisy(self, time_s: float, means: list[tuple[float, float]], extra_m: float) -> GpsFix:
        z, extra = next(self._rows), next(self._extra_rows)
        sigma_m, sigma_mps = self._noise.gps_position_sigma_m, self._noise.gps_velocity_sigma_mps
        wander = self._wander_m
        for i in range(3):
            wander[i] = self._keep * wander[i] + self._kick_m * z[6 + i]
        (n, vn), (e, ve), (d, vd) = means
        position = (
            n + wander[0] + sigma_m * z[0],
            e + wander[1] + sigma_m * z[1],
            d + wander[2] + sigma_m * z[2],
        )
        if extra_m > 0.0:
            n, e, d = position
            position = (n + extra_m * extra[0], e + extra_m * extra[1], d + extra_m * extra[2])
        velocity = (vn + sigma_mps * z[3], ve + sigma_mps * z[4], vd + sigma_mps * z[5])
        return GpsFix(time_s, position, velocity)


class Barometer:
    """White noise on the height."""

    def __init__(self, seed: int, sysid: int) -> None:
        self._rows = noise_rows((seed, sysid, _BARO_STREAM), 1)

    def sample(self, state: PhysicsState) -> float:
        """NED down (m)."""
        return state.position_m[2] + BARO_SIGMA_M * next(self._rows)[0]
