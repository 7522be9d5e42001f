"""How often does the detector cry wolf on healthy fleets?

    python benchmarks/false_alarms.py [--seeds 100] [--minutes 1]

Healthy rovers, each fleet with motor gains, masses and rolling resistances of its own, are probed
and then driven by policies with random weights: they wander, meet walls and each other. Prints
alarms per vehicle-hour for the probe and for the wandering, with exact Poisson intervals (95 %).
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from base_station.listeners import Silent
from base_station.planning.policy import Commands, beta_observation
from base_station.planning.requests import (
    PlanProgress,
    PlanReady,
    PlanRequest,
    PolicyWeights,
    Training,
)
from base_station.records import Event
from base_station.twin import FleetModel
from hil.bench.folders import blind_view
from hil.bench.rig import Rig
from hil.scenario import StationView, load_scenario

SCENARIO = Path(__file__).parents[1] / "scenarios" / "healthy.yaml"
WANDERING = Training("random weights", "none", 0, True, 0, 0.0, ())


class Alarms(Silent):
    """When the first alarm was raised, if any, and in which phase."""

    def __init__(self) -> None:
        self.phase = "connect"
        self.first: tuple[str, float] | None = None

    def event(self, event: Event) -> None:
        if event.kind == "phase":
            self.phase = event.text
        if event.kind == "anomaly" and self.first is None:
            self.first = (self.phase, event.time_s)


def wander(
    view: StationView, request: PlanRequest, _progress: Callable[[PlanProgress], None]
) -> PlanReady:
    """A mission 'plan' that goes nowhere in particular, but briskly."""
    model = FleetModel.from_view(view)
    goals = np.array([[m.goal.north_m, m.goal.east_m] for m in view.fleet])
    delivered = np.zeros((1, model.size), dtype=np.bool_)
    inputs = beta_observation(request.states, delivered, np.zeros(1), model, goals, 0).shape[1]
    rng = np.random.default_rng(request.seed)
    hidden = (rng.normal(0.0, 1.0, (32, inputs)), rng.normal(0.0, 1.0, 32))
    last = (rng.normal(0.0, 0.4, (Commands.of_view(view).size, 32)), np.zeros(6))
    return PlanReady(request.number, "beta", (WANDERING,), policy=PolicyWeights((hidden, last)))


def run(seed: int, minutes: float) -> tuple[float, float, str | None]:
    """Seconds probed, seconds on the way, and the phase of an alarm."""
    scenario = load_scenario(SCENARIO, [f"seed={seed}", f"planning.beta_horizon_s={60 * minutes}"])
    heard = Alarms()
    rig = Rig(scenario, blind_view(scenario), [heard], wander)
    mission_from_s = None
    for _ in rig.run():
        if mission_from_s is None and heard.phase == "mission":
            mission_from_s = rig.time_s
        over = mission_from_s is not None and rig.time_s - mission_from_s > 60 * minutes - 1.0
        if heard.first or over or rig.node.finished:
            break
    begun_s = mission_from_s if mission_from_s is not None else rig.time_s
    return begun_s, rig.time_s - begun_s, heard.first[0] if heard.first else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--minutes", type=float, default=1.0, help="of wandering per fleet")
    options = parser.parse_args()
    vehicles = len(load_scenario(SCENARIO).fleet)
    runs = [run(seed, options.minutes) for seed in range(1000, 1000 + options.seeds)]
    print("| phase | vehicle-hours | alarms | per vehicle-hour (95 %) |\n|---|---|---|---|")
    for k, phase in enumerate(("probe", "mission")):
        hours = vehicles * sum(r[k] for r in runs) / 3600.0
        alarms = sum(r[2] == phase for r in runs)
        low = chi2.ppf(0.025, 2 * alarms) / 2 / hours if alarms else 0.0
        high = chi2.ppf(0.975, 2 * alarms + 2) / 2 / hours
        print(f"| {phase} | {hours:.2f} | {alarms} | {alarms / hours:.2f} ({low:.2f}-{high:.2f}) |")


if __name__ == "__main__":
    main()
