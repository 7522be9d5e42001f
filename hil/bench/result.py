"""result.json: what others script against."""

import json
import os
import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from hil.bench.record import RunRecord
from hil.bench.score import Score
from hil.scenario import Scenario

RESULT_FILE = "result.json"
COMPLETED = "completed"
_PACKAGES = (
    "hil-fleet",
    "numpy",
    "pymavlink",
    "pymunk",
    "rerun-sdk",
    "stable-baselines3",
    "torch",
)


def versions() -> dict[str, str]:
    """Of this project, Python, and what decides the numbers."""
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def result_tree(
    scenario: Scenario, run: RunRecord, score: Score | None, ended: str
) -> dict[str, Any]:
    """The result as plain JSON values.

    `ended` is COMPLETED, or why the run did not get that far; then `score` is None.
    """
    outcome = run.outcome
    return {
        "scenario": scenario.name,
        "seed": scenario.seed,
        "versions": versions(),
        "ended": ended,
        "expected_met": score is not None and score.expected_met,
        "unmet": list(score.unmet) if score else [ended],
        "correct": score is not None and score.correct,
        "alarm": outcome.alarm if outcome else None,
        "verdict": outcome.verdict.model_dump() if outcome and outcome.verdict else None,
        "truth": {
            "faults": [
                {**s.fault.model_dump(mode="json", exclude={"onset"}), "time_s": s.time_s}
                for s in run.struck
            ],
            "hypotheses": _by_sysid(score.true_hypotheses if score else {}),
        },
        "goals": _by_sysid(
            {
                sysid: {
                    "reached": goal.reached,
                    "declared": goal.declared,
                    "time_s": goal.time_s,
                    "final_distance_m": round(goal.distance_m, 4),
                }
                for sysid, goal in (score.goals if score else {}).items()
            }
        ),
        "phases": [p.model_dump() for p in outcome.phases] if outcome else [],
        "trainings": [t.model_dump() for t in outcome.trainings] if outcome else [],
        "contacts": [
            {
                "bodies": list(c.bodies),
                "time_s": round(c.start_s, 4),
                "end_s": round(c.end_s, 4),
                "peak_impulse_ns": round(c.peak_impulse_ns, 4),
            }
            for c in run.contacts
        ],
    }


def write_result(folder: Path, tree: Mapping[str, Any]) -> None:
    """Whole or not at all."""
    partial = folder / f".{RESULT_FILE}.part"
    partial.write_text(json.dumps(tree, indent=2) + "\n", encoding="utf-8")
    os.replace(partial, folder / RESULT_FILE)


def _by_sysid(values: Mapping[int, Any]) -> dict[str, Any]:
    return {str(sysid): value for sysid, value in values.items()}
