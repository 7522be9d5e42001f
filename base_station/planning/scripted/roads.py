"""Ways round obstacles for scripted driving: a visibility graph over points beside them (pure).

`obstacles_m` [O, 5] are strokes with a round brush: from and to (north, east), radius.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import shortest_path

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CORNERS = 8  # points around each end of an obstacle
GAP_M = 0.1  # between a vehicle's rim and an obstacle, at least, on the way
OUT_M = 0.05  # further out than that, so that a line from one point to the next is clear


@dataclass(frozen=True, eq=False)
class Roads:
    """`points_m` [N, 2] to drive by, `length_m` [N, N] the shortest way from one to another,
    `clear_m` [O] how far a vehicle's centre stays from each stroke."""

    obstacles_m: Array
    clear_m: Array
    points_m: Array
    length_m: Array

    @classmethod
    def of(cls, obstacles_m: Array, radius_m: float, low: Array, high: Array) -> Self:
        """For discs of `radius_m` whose centres keep between corners `low` and `high` [2]."""
        clear = obstacles_m[:, 4] + radius_m + GAP_M
        angle = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
        round_m = (clear + OUT_M) / np.cos(np.pi / CORNERS)  # chords between them are clear, too
        offset = round_m[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        ends = obstacles_m[:, :4].reshape(-1, 2, 1, 2)
        points = (ends + offset[:, None]).reshape(-1, 2)
        inside = ((points >= low) & (points <= high)).all(axis=1)
        strokes = obstacles_m[None, :, 0:2], obstacles_m[None, :, 2:4]
        free = inside & (_to_segment(points[:, None], *strokes) >= clear).all(axis=1)
        points = points[free]
        a, b = np.triu_indices(len(points), 1)
        seen = ~barred(points[a], points[b], obstacles_m, clear)
        length = np.full((len(points), len(points)), np.inf)
        length[a[seen], b[seen]] = np.linalg.norm(points[a[seen]] - points[b[seen]], axis=1)
        ways = shortest_path(length, directed=False) if len(points) else length
        return cls(obstacles_m, clear, points, ways)

    def towards(self, position_m: Array, target_m: Array) -> Array:
        """Where to drive next from `position_m` to get to `target_m`, both [E, 2]: straight there,
        or to a point from which the way goes on; straight where there is no way."""
        target_m = np.broadcast_to(target_m, position_m.shape)
        if not len(self.points_m):
            return target_m
        out, back = (self._from(places) for places in (position_m, target_m))
        whole = (out[:, :, None] + self.length_m + back[:, None, :]).min(axis=2)
        best = whole.argmin(axis=1)
        found = self.barred(position_m, target_m) & np.isfinite(whole.min(axis=1))
        return np.where(found[:, None], self.points_m[best], target_m)

    def _from(self, places_m: Array) -> Array:
        """The length [E, N] of the straight lines to all points; infinite where one is barred."""
        shape = (len(places_m), len(self.points_m), 2)
        start = np.broadcast_to(places_m[:, None], shape).reshape(-1, 2)
        end = np.broadcast_to(self.points_m, shape).reshape(-1, 2)
        length = np.where(self.barred(start, end), np.inf, np.linalg.norm(end - start, axis=1))
        return np.asarray(length.reshape(shape[:2]))

    def barred(self, start_m: Array, end_m: Array) -> Flags:
        """Which straight lines [S] from `start_m` to `end_m` [S, 2] are not free."""
        return barred(start_m, end_m, self.obstacles_m, self.clear_m)


def barred(start_m: Array, end_m: Array, obstacles_m: Array, clear_m: Array) -> Flags:
    """Which straight lines [S] come nearer to a stroke than `clear_m` [O], and nearer than they
    begin and end (who stands too close already may leave)."""
    a, b = obstacles_m[None, :, 0:2], obstacles_m[None, :, 2:4]
    start, end = start_m[:, None], end_m[:, None]
    begins, ends = _to_segment(start, a, b), _to_segment(end, a, b)
    nearest = np.minimum(np.minimum(begins, ends), _to_segment(a, start, end))
    nearest = np.minimum(nearest, _to_segment(b, start, end))
    side = _cross(b - a, start - a) * _cross(b - a, end - a)
    other = _cross(end - start, a - start) * _cross(end - start, b - start)
    nearest = np.where((side < 0.0) & (other < 0.0), 0.0, nearest)
    allowed = np.minimum(clear_m, np.minimum(begins, ends))
    return np.asarray((nearest < allowed - 1e-9).any(axis=1))


def _to_segment(point: Array, start: Array, end: Array) -> Array:
    """Distances [S, O] of points to segments, all broadcast to [S, O, 2]."""
    way = end - start
    square = np.maximum((way**2).sum(axis=-1), 1e-12)
    share = np.clip(((point - start) * way).sum(axis=-1) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(point - start - share[..., None] * way, axis=-1))


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
