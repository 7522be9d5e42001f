"""A recording read back as arrays, without a viewer."""

import warnings
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from rerun.chunk import RrdReader

from base_station.recording.columns import SIM_TIME, TRAINING_STEPS

Array = NDArray[np.float64]
NS_PER_S = 1e9


@dataclass(frozen=True, eq=False)
class Series:
    """Lines by name: `values` [T, K] at `times` [T] (s, or training steps)."""

    times: Array
    values: Array
    names: tuple[str, ...]


class Recording:
    """All of a file, in memory."""

    def __init__(self, path: Path) -> None:
        self._chunks: dict[str, list[Any]] = defaultdict(list)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "RRD file has no footer")  # a part, not merged yet
            for chunk in RrdReader(str(path)).stream().to_chunks():
                self._chunks[str(chunk.entity_path)].append(chunk)

    def entities(self, root: str = "/") -> list[str]:
        """Every entity below `root`."""
        return sorted(path for path in self._chunks if path.startswith(root))

    def scalars(self, entity: str, timeline: str = SIM_TIME) -> Series:
        """The scalar series of an entity; empty where there is none."""
        rows = self._rows(entity, "Scalars:scalars", timeline)
        names = self._static(entity, "SeriesLines:names")
        width = max((len(v) for _, v in rows), default=0)
        whole = [(t, v) for t, v in rows if len(v) == width]
        values = np.array([v for _, v in whole], dtype=np.float64).reshape(len(whole), width)
        return Series(np.array([t for t, _ in whole]), values, tuple(map(str, names)))

    def family(self, root: str) -> Series:
        """The series of all entities right below `root`, by name; NaN where one has no row."""
        members = [self.scalars(entity) for entity in self.entities(f"{root}/")]
        times = np.unique(np.concatenate([np.empty(0), *(m.times for m in members)]))
        values = np.full((len(times), len(members)), np.nan)
        for column, member in enumerate(members):
            values[np.searchsorted(times, member.times), column] = member.values[:, 0]
        return Series(times, values, tuple(m.names[0] for m in members))

    def places(self, entity: str) -> tuple[Array, Array]:
        """Times [T] and north, east [T, V, 2] of bodies."""
        rows = self._rows(entity, "Cylinders3D:centers", SIM_TIME)
        places = np.array([[(y, x) for x, y, _ in row] for _, row in rows], dtype=np.float64)
        return np.array([t for t, _ in rows]), places

    def _rows(self, entity: str, component: str, timeline: str) -> list[tuple[float, Any]]:
        rows = []
        for chunk in self._chunks.get(entity, ()):
            batch = chunk.to_record_batch()
            if chunk.is_static or not {component, timeline} <= set(batch.schema.names):
                continue
            ticks = batch.column(timeline).cast(pa.int64()).to_pylist()
            scale = 1.0 if timeline == TRAINING_STEPS else NS_PER_S
            values = batch.column(component).to_pylist()
            rows += [(t / scale, v) for t, v in zip(ticks, values, strict=True) if v]
        return sorted(rows, key=lambda row: row[0])

    def _static(self, entity: str, component: str) -> list[Any]:
        """What was said last, once and for all."""
        said = []
        for chunk in self._chunks.get(entity, ()):
            batch = chunk.to_record_batch()
            if chunk.is_static and component in batch.schema.names:
                ids = batch.column("rerun.controls.RowId").to_pylist()
                said += list(zip(ids, batch.column(component).to_pylist(), strict=True))
        return max(said, key=lambda row: row[0])[1] if said else []
