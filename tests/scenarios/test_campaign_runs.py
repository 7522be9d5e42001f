"""A tiny campaign of real runs: killed and resumed, and repeated in this process."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from hil.bench.campaign.file import load_campaign
from hil.bench.campaign.plan import code_digest, runs
from hil.bench.campaign.row import TIMINGS, Row
from hil.bench.campaign.worker import run_one

ROOT = Path(__file__).parents[2]
CAMPAIGN: dict[str, Any] = {
    "name": "tiny",
    "scenario": str(ROOT / "scenarios" / "rescue.yaml"),
    "layouts": {"count": 1, "apart_m": 1.2},
    "limit_s": 45.0,
    "grid": {
        "fault": {
            "none": {"faults": [], "limit_s": 15.0},
            "motor_y_off": {},
            "struck_by_chance": {
                "limit_s": 15.0,
                "faults": [
                    {
                        "vehicle": {"choice": [1, 3]},
                        "unit": "gps",
                        "type": "stuck",
                        "axes": ["north"],
                        "onset": {"at_s": {"uniform": [3.0, 4.0]}},
                    }
                ],
            },
        }
    },
}


def written(folder: Path) -> Path:
    path = folder / "campaign.yaml"
    path.write_text(yaml.safe_dump(CAMPAIGN, sort_keys=False))
    return path


def command(path: Path, out: Path, *more: str) -> list[str]:
    return [sys.executable, "-m", "hil.cli", "campaign", str(path), "--out", str(out), *more]


def told(rows: list[Row]) -> list[Row]:
    return [replace(r, **dict.fromkeys(TIMINGS, 0.0)) for r in rows]


def journal(out: Path) -> list[Row]:
    lines = (out / "runs.jsonl").read_text().splitlines()
    return [Row.of_tree(json.loads(line)) for line in lines]


def test_killed_and_resumed_it_comes_to_what_the_worker_comes_to(tmp_path: Path) -> None:
    path, out = written(tmp_path), tmp_path / "out"
    with subprocess.Popen(
        command(path, out, "--jobs", "1"), cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        for line in child.stdout:  # one run is on disk when it is counted
            if line.startswith("1 of 3 runs"):
                break
        os.kill(child.pid, signal.SIGKILL)
    before = journal(out)
    assert 1 <= len(before) < 3
    done = subprocess.run(
        command(path, out, "--jobs", "2"), cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{len(before)} done already" in done.stdout
    rows = {r.key: r for r in journal(out)}
    assert len(rows) == len(journal(out)) == 3
    specs = runs(path, load_campaign(path), code_digest())
    again = [run_one(spec) for spec in specs]
    assert told([rows[spec.key] for spec in specs]) == told(again)
    none, motor, gps = again
    assert not any(r.error for r in again)
    assert none.truth == none.meant == "none"
    assert none.fleet_s == pytest.approx(15.0, abs=0.1)
    assert motor.truth == "motor_y_off"
    assert motor.onset_s == 0.0
    assert gps.suspect in (None, 1, 3)
    assert gps.truth == gps.meant == "gps_north_stuck"
    assert gps.onset_s is not None
    assert 3.0 <= gps.onset_s <= 4.3
    assert gps.healthy_vehicle_s == pytest.approx(2 * gps.fleet_s + gps.onset_s)


def test_a_run_that_fails_is_a_row(tmp_path: Path) -> None:
    path = written(tmp_path)
    spec = runs(path, load_campaign(path), "")[0]
    broken = replace(spec, tree={**spec.tree, "arena": None})
    assert run_one(broken).error.startswith("ValidationError")
