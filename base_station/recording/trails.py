"""Trails as short steps, each logged once; how much of one is seen is the view's choice."""

import math
from collections.abc import Hashable

from base_station.recording.palette import Rgb
from base_station.recording.scene import Point3

STEP_M = 0.1  # a trail grows when its vehicle has moved this far: noise draws no scribble


class Trails:
    """Remembers where each trail ended."""

    def __init__(self) -> None:
        self._ends: dict[Hashable, Point3] = {}

    def step(self, key: Hashable, point: Point3, color: Rgb) -> tuple[float, ...] | None:
        """The row of `SEGMENTS` from the last end to here, or None while nothing moved."""
        end = self._ends.setdefault(key, point)
        if math.dist(end, point) < STEP_M:
            return None
        self._ends[key] = point
        red, green, blue = color
        return (*end, *point, float(red << 24 | green << 16 | blue << 8 | 0xFF))

    def forget(self, name: str) -> None:
        """The trails of (name, ...) start anew."""
        for key in [k for k in self._ends if isinstance(k, tuple) and k[0] == name]:
            del self._ends[key]
