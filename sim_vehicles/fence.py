"""The geofence: zones on the ground, and whether a point is outside (pure; north, east in m).

As in ArduPilot a vehicle must be inside every inclusion zone and outside every exclusion zone.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from hil.frames import Origin, wgs84_to_ned
from hil.mavlink import Command, MissionItem

Point = tuple[float, float]
POLYGONS = {
    Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLES = {Command.NAV_FENCE_CIRCLE_INCLUSION: True, Command.NAV_FENCE_CIRCLE_EXCLUSION: False}


@dataclass(frozen=True, slots=True)
class Circle:
    """A disc that has to be kept (inclusion) or avoided."""

    centre_m: Point
    radius_m: float
    inclusion: bool

    def contains(self, point: Point) -> bool:
        return math.dist(self.centre_m, point) <= self.radius_m


@dataclass(frozen=True, slots=True)
class Polygon:
    """The same with corners; it closes itself."""

    corners_m: tuple[Point, ...]
    inclusion: bool

    def contains(self, point: Point) -> bool:
        """Whether a ray to the north crosses the outline an odd number of times."""
        north, east = point
        inside = False
        for (n1, e1), (n2, e2) in zip(
            self.corners_m, (*self.corners_m[1:], self.corners_m[0]), strict=True
        ):
            if (e1 > east) != (e2 > east) and north < n1 + (n2 - n1) * (east - e1) / (e2 - e1):
                inside = not inside
        return inside


Zone = Circle | Polygon


def breached(zones: Iterable[Zone], point: Point) -> bool:
    return any(zone.contains(point) != zone.inclusion for zone in zones)


def zones_of(items: Sequence[MissionItem], origin: Origin) -> tuple[Zone, ...] | None:
    """The zones of a fence list; None when polygons are cut short or a radius is not one."""
    zones: list[Zone] = []
    at = 0
    while at < len(items):
        first = items[at]
        number = first.params[0]
        if first.command in CIRCLES:
            if not (math.isfinite(number) and number > 0.0):
                return None
            zones.append(Circle(_point(first, origin), number, CIRCLES[Command(first.command)]))
            at += 1
        elif first.command in POLYGONS:
            if not (3 <= number <= len(items) - at):
                return None
            corners = items[at : at + int(number)]
            if any((c.command, c.params[0]) != (first.command, number) for c in corners):
                return None
            points = tuple(_point(c, origin) for c in corners)
            zones.append(Polygon(points, POLYGONS[Command(first.command)]))
            at += len(corners)
        else:
            at += 1  # a return point bounds nothing
    return tuple(zones)


def _point(item: MissionItem, origin: Origin) -> Point:
    return wgs84_to_ned(item.x / 1e7, item.y / 1e7, origin)
