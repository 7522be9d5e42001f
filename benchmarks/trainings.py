"""How often does a planner succeed from scratch, without restarts, and what does it cost?

    python benchmarks/trainings.py [--trainings 10] [--cases near far beta] [--preset tuned paper]
                                   [--planner ppo cem ...] [--objective information ...]

One seed after the other on one thread; times are CPU seconds of this process. near and far: three
rovers in a row 2.5 or 4.3 m apart, the suspect held, `motor_y_off` or `gps_east_stuck`. beta: the
mission of `rescue` from its start, y motors off. Success is what the planner promises: a predicted
error of at most 1 % in 90 % of draws; all goals in 95 % of perturbed rollouts. `hil reproduce` has
more.
"""

import argparse
import statistics
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from base_station.planning.laboratory.jobs import Job
from base_station.planning.laboratory.measure import APART_M, row_of_three
from base_station.planning.laboratory.tables import wilson
from base_station.planning.planner import plan
from base_station.planning.process import warm_up
from base_station.planning.requests import PlanRequest
from hil.scenario import StationView, load_scenario, station_view

RESCUE = Path(__file__).parents[1] / "scenarios" / "rescue.yaml"


@dataclass(frozen=True)
class Row:
    """One case, planner, objective and preset over all seeds."""

    name: str
    accepted: tuple[bool, ...]
    cpu_s: tuple[float, ...]
    timesteps: tuple[int, ...]


def main() -> None:
    print(
        "| case, planner, objective, preset | success | 95 % interval | CPU s, median (largest) "
        "| steps, median |\n|---|---|---|---|---|"
    )
    for row in rows(_options()):
        low, high = wilson(sum(row.accepted), len(row.accepted))
        print(
            f"| {row.name} | {sum(row.accepted)} of {len(row.accepted)} "
            f"| {100 * low:.0f}-{100 * high:.0f} % "
            f"| {statistics.median(row.cpu_s):.1f} ({max(row.cpu_s):.1f}) "
            f"| {statistics.median(row.timesteps):,.0f} |",
            flush=True,
        )


def rows(options: argparse.Namespace) -> Iterator[Row]:
    view = station_view(load_scenario(RESCUE), mavlink_port_base=14550, station_seed=1)
    warm_up(view)
    kinds = product(options.cases, options.planner, options.objective, options.preset)
    for case, planner, objective, preset in kinds:
        changes = {"planner": planner, "objective": objective, "restarts": 0}
        planning = view.planning.model_copy(update=changes)
        asked = view.model_copy(update={"planning": planning})
        seeds = range(options.first, options.first + options.trainings)
        jobs = [Job("paper", case, planner, preset, seed) for seed in seeds]
        tries = [once(asked, row_of_three(view, job)) for job in jobs]
        accepted, cpu_s, timesteps = zip(*tries, strict=True)
        name = f"{case}, {planner}, {objective if case != 'beta' else '-'}, {preset}"
        yield Row(name, accepted, cpu_s, timesteps)


def once(view: StationView, asked: PlanRequest) -> tuple[bool, float, int]:
    """Success, CPU time (s) and time steps of one training."""
    started_s = time.process_time()
    (training,) = plan(view, asked, lambda _: None).trainings
    return training.accepted, time.process_time() - started_s, training.timesteps


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trainings", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--cases", nargs="+", choices=APART_M, default=list(APART_M))
    parser.add_argument("--planner", nargs="+", default=["ppo"])
    parser.add_argument("--objective", nargs="+", default=["information"])
    parser.add_argument("--preset", nargs="+", default=["tuned"])
    return parser.parse_args()


if __name__ == "__main__":
    main()
