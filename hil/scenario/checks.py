"""Checks that a scenario and the station's view of it share."""

from collections.abc import Sequence
from typing import Protocol

from hil.airframe import Airframe
from hil.scenario.places import Arena, Geofence, Obstacle, Point, Rectangle


class Member(Protocol):
    """A vehicle, as both of them have it."""

    @property
    def name(self) -> str: ...

    @property
    def frame(self) -> Airframe: ...


def unique(where: str, values: Sequence[object]) -> None:
    for value in values:
        if values.count(value) > 1:
            raise ValueError(f"{where} = {value!r} is used more than once; make each unique")


def keep_inside(area: Rectangle, field: str, fleet: Sequence[Member]) -> None:
    for i, v in enumerate(fleet):
        if not area.contains(getattr(v, field), v.frame.radius_m):
            raise ValueError(
                f"fleet.{i}.{field} of {v.name} is outside the {type(area).__name__.lower()} less "
                f"the vehicle's radius of {v.frame.radius_m} m; move it inside"
            )


def check_fence(
    fence: Geofence | None, arena: Arena, fields: Sequence[str], fleet: Sequence[Member]
) -> None:
    """A geofence lies in the arena, and everybody's `fields` in it."""
    if fence is None:
        return
    for corner in (
        Point(north_m=fence.north_min_m, east_m=fence.east_min_m),
        Point(north_m=fence.north_max_m, east_m=fence.east_max_m),
    ):
        if not arena.contains(corner):
            raise ValueError(
                f"geofence: its corner at north {corner.north_m:g} m, east {corner.east_m:g} m is "
                "outside the arena; move it inside"
            )
    for field in fields:
        keep_inside(fence, field, fleet)


def keep_clear(obstacles: Sequence[Obstacle], field: str, fleet: Sequence[Member]) -> None:
    for i, v in enumerate(fleet):
        for k, obstacle in enumerate(obstacles):
            room_m = obstacle.distance_m(getattr(v, field))
            if room_m < v.frame.radius_m:
                raise ValueError(
                    f"fleet.{i}.{field} of {v.name} is {room_m:.2f} m from obstacles.{k}; its "
                    f"radius of {v.frame.radius_m} m is needed: move one of them"
                )
