"""The table of a campaign: one Parquet file, a row per run, in the order of the plan."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from hil.bench.campaign.row import Row

TABLE_FILE = "runs.parquet"
_DERIVED = ("said", "correct", "wrong", "delay_s", "judging_s")
_CHANCES = pa.map_(pa.string(), pa.float64())
_TYPES: dict[str, Any] = {
    "point": pa.map_(pa.string(), pa.string()),
    "posterior": _CHANCES,
    "prior": _CHANCES,
    "looks": pa.map_(pa.string(), _CHANCES),
    "false_alarm_sysids": pa.list_(pa.int64()),
    "onset_s": pa.float64(),
    "alarm_s": pa.float64(),
    "verdict_s": pa.float64(),
    "delay_s": pa.float64(),
    "judging_s": pa.float64(),
    "suspect": pa.int64(),
    "hypothesis": pa.string(),
}


def write_table(folder: Path, rows: Sequence[Row]) -> Path:
    """Whole or not at all. Each axis of the grid is a column of its own, too."""
    axes = sorted({axis for row in rows for axis in row.point})
    trees = [
        row.tree()
        | {f"point_{axis}": row.point.get(axis) for axis in axes}
        | {name: getattr(row, name) for name in _DERIVED}
        for row in rows
    ]
    columns = {name: [tree[name] for tree in trees] for name in trees[0]}
    arrays = {
        name: pa.array([_pairs(v) for v in values], type=_TYPES.get(name))
        for name, values in columns.items()
    }
    path, partial = folder / TABLE_FILE, folder / f".{TABLE_FILE}.part"
    pq.write_table(pa.table(arrays), partial)
    os.replace(partial, path)
    return path


def _pairs(value: Any) -> Any:
    """A map as pyarrow takes it."""
    if isinstance(value, dict):
        return [(key, _pairs(inner)) for key, inner in value.items()]
    return value
