"""Sensors: what the physics state looks like through noise, and through a GPS fault.

The draws never depend on faults, so the same seed gives the same noise with and without one.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hil.physics_link import PhysicsState
from hil.scenario import Sensors as Noise

Vector = tuple[float, float, float]
_GYRO_STREAM, _GPS_STREAM = 0x4759524F, 0x475053
_BLOCK = 256


@dataclass(frozen=True, slots=True)
class Inertial:
    """Gyro (body, rad/s) and compass heading (rad), each autopilot step."""

    gyro_radps: Vector
    compass_rad: float


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
    """White noise on gyro and compass."""

    def __init__(self, noise: Noise, seed: int, sysid: int) -> None:
        self._gyro_sigma, self._compass_sigma = noise.gyro_sigma_radps, noise.compass_sigma_rad
        self._rows = noise_rows((seed, sysid, _GYRO_STREAM), 4)

    def sample(self, state: PhysicsState) -> Inertial:
        z = next(self._rows)
        (p, q, r), sigma = state.gyro_radps, self._gyro_sigma
        gyro = (p + sigma * z[0], q + sigma * z[1], r + sigma * z[2])
        return Inertial(gyro, state.attitude_rad[2] + self._compass_sigma * z[3])


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
        self._keep = math.exp(-self._period_s / noise.gps_wander_time_s)
        self._kick_m = noise.gps_wander_sigma_m * math.sqrt(1.0 - self._keep**2)
        self._wander_m = [noise.gps_wander_sigma_m * z for z in next(self._rows)[:3]]
        self._frozen: dict[int, tuple[float, float]] = {}  # axis: mean position and velocity

    def sample(self, state: PhysicsState, stuck_mask: int) -> GpsFix | None:
        """The fix at this step if one is due; `stuck_mask` has bits N, E, D."""
        means = [self._mean(state, axis, stuck_mask) for axis in range(3)] if stuck_mask else None
        if not stuck_mask and self._frozen:
            self._frozen.clear()
        if state.time_s + 1e-6 < self._due_s:
            return None
        self._due_s = (math.floor(state.time_s / self._period_s + 1e-6) + 1) * self._period_s
        z = next(self._rows)
        if means is None:
            means = list(zip(state.position_m, state.velocity_mps, strict=True))
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
        velocity = (vn + sigma_mps * z[3], ve + sigma_mps * z[4], vd + sigma_mps * z[5])
        return GpsFix(state.time_s, position, velocity)

    def _mean(self, state: PhysicsState, axis: int, stuck_mask: int) -> tuple[float, float]:
        now = (state.position_m[axis], state.velocity_mps[axis])
        if stuck_mask >> axis & 1:
            return self._frozen.setdefault(axis, now)
        self._frozen.pop(axis, None)
        return now
