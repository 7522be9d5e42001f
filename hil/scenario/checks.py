"""Checks that a scenario and the station's view of it share."""

from collections.abc import Sequence
from typing import Protocol

from hil.airframe import Airframe
from hil.scenario.places import Arena


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


def keep_inside(arena: Arena, field: str, fleet: Sequence[Member]) -> None:
    for i, v in enumerate(fleet):
        if not arena.contains(getattr(v, field), v.frame.radius_m):
            raise ValueError(
                f"fleet.{i}.{field} of {v.name} is outside the arena less the vehicle's "
                f"radius of {v.frame.radius_m} m; move it inside"
            )
