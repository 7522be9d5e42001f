"""A campaign on Ray: the same table as on joblib."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import yaml

from hil.bench.campaign.row import TIMINGS

ROOT = Path(__file__).parents[2]
CAMPAIGN = {
    "name": "tiny",
    "scenario": str(ROOT / "scenarios" / "rescue.yaml"),
    "layouts": {"count": 2, "apart_m": 1.2},
    "limit_s": 12.0,
}


@pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="Ray is an extra")
def test_ray_gives_the_same_table(tmp_path: Path) -> None:
    path, tables = tmp_path / "campaign.yaml", []
    path.write_text(yaml.safe_dump(CAMPAIGN))
    for backend in ("local", "ray"):
        out = tmp_path / backend
        command = [sys.executable, "-m", "hil.cli", "campaign", str(path), "--out", str(out)]
        with (tmp_path / f"{backend}.log").open("w+") as log:  # no pipe: Ray's children inherit it
            done = subprocess.run(
                [*command, "--jobs", "2", "--backend", backend],
                cwd=ROOT,
                stdout=log,
                stderr=log,
                check=False,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
            )
            log.seek(0)
            assert done.returncode == 0, log.read()
        tables.append(pq.read_table(out / "runs.parquet").drop_columns(list(TIMINGS)))
    assert tables[0].equals(tables[1])
