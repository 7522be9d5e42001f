"""Reading a recording back, without a viewer."""

import math
from pathlib import Path
from typing import Any

import pyarrow as pa
from rerun.chunk import RrdReader

Rows = list[tuple[float, Any]]  # (time, value); s for sim_time, steps for training_steps

NS_PER_S = 1e9


def rows(path: Path, entity: str, component: str, timeline: str = "sim_time") -> Rows:
    """All rows of a component, by time; static ones have time NaN."""
    found: Rows = []
    for chunk in RrdReader(str(path)).stream().filter(content=entity).to_chunks():
        batch = chunk.to_record_batch()
        if component not in batch.schema.names:
            continue
        values = batch.column(component).to_pylist()
        if chunk.is_static:
            found += [(math.nan, value) for value in values]
        elif timeline in chunk.timeline_names:
            ticks = batch.column(timeline).cast(pa.int64()).to_pylist()
            scale = 1.0 if timeline == "training_steps" else NS_PER_S
            found += [(tick / scale, v) for tick, v in zip(ticks, values, strict=True)]
    return sorted((row for row in found if row[1] is not None), key=lambda row: row[0])


def temporal(path: Path, entity: str, component: str, timeline: str = "sim_time") -> Rows:
    """The same without static rows."""
    return [row for row in rows(path, entity, component, timeline) if not math.isnan(row[0])]


def entities(path: Path) -> set[str]:
    """Every entity of the recording; the blueprint's are not among them."""
    return {str(chunk.entity_path) for chunk in RrdReader(str(path)).stream().to_chunks()}
