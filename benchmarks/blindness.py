"""Before plan alpha, can a classifier on telemetry alone tell `rescue` from `stuck_gps`?

    python benchmarks/blindness.py [--seeds 100]

Every run is up to the experiment, with a seed of its own. Features: all positions and velocities
that the station received of the suspect and its neighbours, brought to a common grid; logistic
regression and a random forest, cross-validated. Both must stay at chance, 0.5 +- 0.1.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from base_station.listeners import Silent
from base_station.records import Snapshot
from hil.bench.folders import blind_view
from hil.bench.injector import Breaker
from hil.bench.onsets import Onsets
from hil.bench.rig import Rig
from hil.scenario import load_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"
PROBE_TICKS = 150


class Positions(Silent):
    """What the station received, tick by tick, until it begins to plan."""

    def __init__(self) -> None:
        self.rows: list[list[float]] = []
        self.done = False

    def snapshot(self, snapshot: Snapshot) -> None:
        self.done |= snapshot.phase != "probe"
        if not self.done:
            self.rows.append(
                [x for v in snapshot.vehicles for x in (*v.reported_m, *v.velocity_mps)]
            )


def features(name: str, seed: int) -> np.ndarray:
    """[PROBE_TICKS * 12] of one run."""
    scenario = load_scenario(SCENARIOS / f"{name}.yaml", [f"seed={seed}"])
    heard = Positions()
    rig = Rig(scenario, blind_view(scenario), [heard])
    breaker = Breaker(scenario, lambda _: None, lambda _: None, rig.simulation.obey)
    breaker.strike(Onsets(scenario).at_start())
    while not breaker.done:
        for vehicle, link in zip(scenario.fleet, rig.injector_links, strict=True):
            for datagram in breaker.step(rig.time_s, vehicle.sysid, link.receive()):
                link.send(datagram)
        rig.serve()
    for _ in rig.run():
        if heard.done or len(heard.rows) >= PROBE_TICKS:
            break
    return np.array(heard.rows[:PROBE_TICKS]).ravel()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100, help="runs of each scenario")
    count = parser.parse_args().seeds
    rows = [features("rescue", seed) for seed in range(count)]
    rows += [features("stuck_gps", seed) for seed in range(count, 2 * count)]
    x, y = np.array(rows), np.repeat([0, 1], count)
    learners = {
        "logistic regression": make_pipeline(StandardScaler(), LogisticRegression(C=0.01)),
        "random forest": RandomForestClassifier(300, random_state=0),
    }
    print("| classifier | accuracy, 10-fold | runs |\n|---|---|---|")
    accuracies = [cross_val_score(c, x, y, cv=10).mean() for c in learners.values()]
    for learner, accuracy in zip(learners, accuracies, strict=True):
        print(f"| {learner} | {accuracy:.3f} | {2 * count} |")
    sys.exit(0 if all(abs(a - 0.5) <= 0.1 for a in accuracies) else 1)


if __name__ == "__main__":
    main()
