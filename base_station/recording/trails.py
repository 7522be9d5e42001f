"""Trails as short steps, each logged once; how much of one is seen is the view's choice."""

import math
from collections.abc import Hashable

from base_station.recording.scene import Point3

STEP_M = 0.05  # a trail grows when its vehicle has moved this far: noise draws no scribble


class Trails:
    """Remembers where each trail ended."""

    def __init__(self) -> None:
        self._ends: dict[Hashable, Point3] = {}

    def step(self, key: Hashable, point: Point3) -> tuple[float, ...] | None:
        """The line from the last end to here (both ends, m), or None while nothing moved."""
        end = self._ends.setdefault(key, point)
        if math.dist(end, point) < STEP_M:
            return None
        self._ends[key] = point
        return (*end, *point)

    def forget(self, name: str) -> None:
        """The vehicles of a twin start anew."""
        self._ends = {k: v for k, v in self._ends.items() if not (isinstance(k, tuple) and k[0] == name)}
