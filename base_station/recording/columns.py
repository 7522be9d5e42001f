"""Rows kept back for a moment and sent as columns: about a tenth of the cost of logging each."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

SIM_TIME, WALL_TIME, TRAINING_STEPS = "sim_time", "wall_time", "training_steps"
RING_M = 0.001  # height of a ring
MAX_TICKS = 50  # kept back at most, however fast the simulation runs


@dataclass(frozen=True)
class Kind:
    """What an instance of `width` numbers becomes; `build` takes [k, width]."""

    width: int
    build: Callable[[NDArray[np.float64]], Any]


def _bodies(flat: NDArray[np.float64]) -> Any:
    """A disc, and a dot at its nose: half the bytes of a line."""
    discs = rr.Cylinders3D.columns(centers=flat[:, :3])
    return rr.ComponentColumnList([*discs, *rr.Points3D.columns(positions=flat[:, 3:])])


def _segments(flat: NDArray[np.float64]) -> Any:
    return rr.LineStrips3D.columns(
        strips=flat[:, :6].reshape(-1, 2, 3), colors=flat[:, 6].astype(np.uint32)
    )


def _rings(flat: NDArray[np.float64]) -> Any:
    lengths = np.full(len(flat), RING_M)
    return rr.Cylinders3D.columns(centers=flat[:, :3], radii=flat[:, 3], lengths=lengths)


def _cameras(flat: NDArray[np.float64]) -> Any:
    """Above what they show, looking down, north up: half a turn about the axis to the east."""
    half_turns = np.tile((1.0, 0.0, 0.0, 0.0), (len(flat), 1))
    return rr.Transform3D.columns(translation=flat, quaternion=half_turns)


SCALARS = Kind(1, lambda flat: rr.Scalars.columns(scalars=flat[:, 0]))
BODIES = Kind(6, _bodies)  # centre, nose
SEGMENTS = Kind(7, _segments)  # both ends, colour as 0xRRGGBBAA
ARROWS = Kind(6, lambda flat: rr.Arrows3D.columns(origins=flat[:, :3], vectors=flat[:, 3:]))
RINGS = Kind(4, _rings)  # centre, radius; with static radii an empty row would still show a ring
SPOTS = Kind(6, lambda flat: rr.Ellipsoids3D.columns(centers=flat[:, :3], half_sizes=flat[:, 3:]))
CAMERAS = Kind(3, _cameras)
GEO_POINTS = Kind(2, lambda flat: rr.GeoPoints.columns(positions=flat))  # degrees


def set_time(stream: Any, time_s: float) -> None:
    """What is logged from here on belongs to `time_s` (sim_time, s) and now (wall_time)."""
    stream.set_time(SIM_TIME, duration=time_s)
    stream.set_time(WALL_TIME, timestamp=time.time())


class Batch:
    """Collects rows tick by tick; sends them at least every `period_s` of wall time."""

    def __init__(self, stream: Any, period_s: float) -> None:
        self._stream, self._period_s = stream, period_s
        self._sim_s: list[float] = []
        self._wall_s: list[float] = []
        self._rows: dict[tuple[str, Kind], tuple[list[int], list[NDArray[np.float64]]]] = {}

    def tick(self, time_s: float) -> None:
        """Rows added from here on belong to `time_s` (sim_time, s)."""
        now_s = time.time()
        if self._wall_s and (
            len(self._wall_s) >= MAX_TICKS or not 0 <= now_s - self._wall_s[0] < self._period_s
        ):
            self.send()
        self._sim_s.append(time_s)
        self._wall_s.append(now_s)

    def add(self, path: str, kind: Kind, row: ArrayLike) -> None:
        """One row for this tick: one instance or several; none clears what was there."""
        ticks, rows = self._rows.setdefault((path, kind), ([], []))
        ticks.append(len(self._sim_s) - 1)
        rows.append(np.asarray(row, dtype=np.float64).reshape(-1, kind.width))

    def send(self) -> None:
        """Hand everything over to the stream."""
        indexes: dict[tuple[int, ...], list[Any]] = {}
        for (path, kind), (ticks, rows) in self._rows.items():
            key = tuple(ticks)
            if key not in indexes:
                indexes[key] = self._index(ticks)
            columns = kind.build(np.concatenate(rows))
            lengths = [len(row) for row in rows]
            if set(lengths) != {1}:
                columns = columns.partition(lengths)
            self._stream.send_columns(path, indexes=indexes[key], columns=columns)
        self._rows.clear()
        self._sim_s.clear()
        self._wall_s.clear()

    def _index(self, ticks: list[int]) -> list[Any]:
        return [
            rr.TimeColumn(SIM_TIME, duration=[self._sim_s[i] for i in ticks]),
            rr.TimeColumn(WALL_TIME, timestamp=[self._wall_s[i] for i in ticks]),
        ]
