"""What the tests of the bench start from: the rescue, and a station's account of it."""

from pathlib import Path
from typing import Any

from hil.bench.lines import Outcome
from hil.bench.record import RunRecord, Struck
from hil.scenario import Scenario, load_scenario
from hil.world.truth import ContactEpisode, TruthRecord, VehicleTruth

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RESCUE = SCENARIOS / "rescue.yaml"


def rescue(*overrides: str) -> Scenario:
    return load_scenario(RESCUE, overrides)


def outcome(**changes: Any) -> Outcome:
    """A station that got everything right."""
    verdict = {
        "sysid": 2,
        "hypothesis": "motor_y_off",
        "posterior": {"motor_y_off": 0.997, "gps_east_stuck": 0.003},
        "decided": True,
    }
    reached = {"declared": "reached", "time_s": 30.0}
    training = {"planner": "ppo", "preset": "tuned", "timesteps": 8192, "wall_s": 2.5}
    tree = {
        "verdict": verdict,
        "alarm": True,
        "goals": {1: reached, 2: reached, 3: reached},
        "phases": [
            {"phase": "probe", "wall_s": 3.0, "sim_s": 3.0},
            {"phase": "plan_alpha", "wall_s": 2.0, "sim_s": 2.0},
        ],
        "trainings": [{**training, "kind": "alpha", "restarts": 1}],
    }
    return Outcome.model_validate(tree | changes)


def record(scenario: Scenario, told: Outcome | None = None, off_by_m: float = 0.1) -> RunRecord:
    """All faults struck at once; every vehicle ends `off_by_m` north of its goal."""
    vehicles = {
        v.sysid: VehicleTruth(v.goal.north_m + off_by_m, v.goal.east_m, 0.0, 0.0, 0.0)
        for v in scenario.fleet
    }
    return RunRecord(
        told or outcome(),
        TruthRecord(60.0, vehicles),
        (ContactEpisode(12.0, 14.0, ("rover_1", "rover_2"), 3.25, (1.0, 2.0)),),
        tuple(Struck(f, 0.0) for f in scenario.faults),
    )
