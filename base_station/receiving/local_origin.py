"""Where a vehicle's local NED begins, in the fleet's NED (pure)."""

from collections import deque
from dataclasses import dataclass, field

from hil import mavlink
from hil.frames import Origin, wgs84_to_ned

PAIRS = 10  # of global and local positions, averaged: one is worth 1 cm (1e-7 deg)
SAME_TIME_S = 0.1
Point = tuple[float, float]


@dataclass
class LocalOrigin:
    """`offset_m` (north, east) is to be added to what the vehicle reports; None: not known yet.

    The best word counts: GPS_GLOBAL_ORIGIN, else HOME_POSITION (its place in both frames), else
    the mean of GLOBAL_POSITION_INT less LOCAL_POSITION_NED.
    """

    fleet_origin: Origin
    _said: Point | None = None
    _home: Point | None = None
    _local: mavlink.LocalPosition | None = None
    _pairs: deque[Point] = field(default_factory=lambda: deque(maxlen=PAIRS))

    def hear(self, value: object) -> None:
        match value:
            case mavlink.GpsOrigin():
                self._said = self._ned(value.lat_deg, value.lon_deg)
            case mavlink.HomePosition():
                north, east = self._ned(value.lat_deg, value.lon_deg)
                self._home = (north - value.position_m[0], east - value.position_m[1])
            case mavlink.LocalPosition():
                self._local = value
            case mavlink.GlobalPosition() if self._local is not None:
                self._pair(value, self._local)
            case _:
                pass

    @property
    def offset_m(self) -> Point | None:
        if self._said is not None or self._home is not None:
            return self._said or self._home
        if len(self._pairs) < PAIRS:
            return None
        return (
            sum(north for north, _ in self._pairs) / PAIRS,
            sum(east for _, east in self._pairs) / PAIRS,
        )

    def _pair(self, told: mavlink.GlobalPosition, local: mavlink.LocalPosition) -> None:
        age_s = told.time_s - local.time_s
        if abs(age_s) > SAME_TIME_S:
            return
        north, east = self._ned(told.lat_deg, told.lon_deg)
        self._pairs.append(
            (
                north - local.position_m[0] - age_s * local.velocity_mps[0],
                east - local.position_m[1] - age_s * local.velocity_mps[1],
            )
        )

    def _ned(self, lat_deg: float, lon_deg: float) -> Point:
        return wgs84_to_ned(lat_deg, lon_deg, self.fleet_origin)
