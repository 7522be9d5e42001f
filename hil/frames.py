"""Frames: local NED (m, from the origin), body (x forward, y right) and WGS84.

Yaw is in radians, 0 to the north, positive clockwise seen from above (NED).
"""

import math
from dataclasses import dataclass

EARTH_RADIUS_M = 6_378_137.0  # WGS84 equatorial radius; the flat-earth error is < 1 mm at 100 m


@dataclass(frozen=True)
class Origin:
    """Where local NED has its zero."""

    lat_deg: float
    lon_deg: float
    alt_m: float


def body_to_ned(x: float, y: float, yaw_rad: float) -> tuple[float, float]:
    """Turn a horizontal vector from body to NED."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return c * x - s * y, s * x + c * y


def ned_to_body(north: float, east: float, yaw_rad: float) -> tuple[float, float]:
    """Turn a horizontal vector from NED to body."""
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return c * north + s * east, -s * north + c * east


def ned_to_wgs84(north_m: float, east_m: float, origin: Origin) -> tuple[float, float]:
    """Latitude and longitude in degrees of a local point."""
    lat = origin.lat_deg + math.degrees(north_m / EARTH_RADIUS_M)
    lon = origin.lon_deg + math.degrees(
        east_m / (EARTH_RADIUS_M * math.cos(math.radians(origin.lat_deg)))
    )
    return lat, lon


def wgs84_to_ned(lat_deg: float, lon_deg: float, origin: Origin) -> tuple[float, float]:
    """North and east in metres of a point on the globe; the inverse of `ned_to_wgs84`."""
    north = math.radians(lat_deg - origin.lat_deg) * EARTH_RADIUS_M
    east = math.radians(lon_deg - origin.lon_deg) * (
        EARTH_RADIUS_M * math.cos(math.radians(origin.lat_deg))
    )
    return north, east


def wrap_pi(angle_rad: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
