"""The shipped scenarios end to end, learning included, as `hil run --in-memory` runs them."""

import json
from pathlib import Path

import pytest

from hil.bench.run import RunOptions, run
from hil.errors import EXIT_AS_EXPECTED
from hil.scenario import load_scenario
from tests.conftest import SCENARIOS

NAMES = ("rescue", "stuck_gps", "healthy", "midway", "rescue_yaw")


@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scenario_meets_its_expectation(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    code = run(scenario, RunOptions(out=tmp_path / "run", in_memory=True))
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert code == EXIT_AS_EXPECTED, result["unmet"]
    assert result["correct"]
    for goal in result["goals"].values():
        if goal["declared"] == "reached":
            assert goal["final_distance_m"] <= 0.3


def test_every_shipped_scenario_is_run_here() -> None:
    assert {p.stem for p in SCENARIOS.glob("*.yaml")} == set(NAMES)
