"""The white noise of a receiver at rest, from its own words (pure)."""

import math
from dataclasses import dataclass, field

import numpy as np

from hil.frames import Origin, wgs84_to_ned
from hil.mavlink import GpsRaw

STEP_M = 0.0111  # 1e-7 deg, as GPS_RAW_INT carries it
STEP_MPS = 0.01
FEWEST = 40


@dataclass(frozen=True)
class NoiseFit:
    """Standard deviations per axis, and how many fixes they rest on."""

    gps_position_sigma_m: float
    gps_velocity_sigma_mps: float
    fixes: int


@dataclass
class RestNoise:
    """Takes fixes of a vehicle while it stands. `pause` where it has moved in between."""

    origin: Origin
    _last: tuple[float, float, float] | None = None  # time, north, east
    _steps_m2: list[float] = field(default_factory=list)
    _speeds: list[float] = field(default_factory=list)

    def pause(self) -> None:
        self._last = None

    def take(self, fix: GpsRaw) -> None:
        north, east = wgs84_to_ned(fix.lat_deg, fix.lon_deg, self.origin)
        if self._last is not None:
            if fix.time_s <= self._last[0]:
                return  # the same fix again
            self._steps_m2.append(((north - self._last[1]) ** 2 + (east - self._last[2]) ** 2) / 2)
            self._speeds.append(fix.speed_mps)
        self._last = (fix.time_s, north, east)

    def fit(self) -> NoiseFit | None:
        """From differences of successive fixes: slow wander does not count. None: too few."""
        if len(self._steps_m2) < FEWEST:
            return None
        position = float(np.mean(self._steps_m2)) / 2.0 - STEP_M**2 / 12.0
        velocity = float(np.mean(np.square(self._speeds))) / 2.0 - STEP_MPS**2 / 12.0
        return NoiseFit(
            math.sqrt(max(0.0, position)), math.sqrt(max(0.0, velocity)), len(self._steps_m2)
        )
