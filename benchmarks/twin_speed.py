"""How fast is the twin? Ratios from one run, on one thread.

    pip install vmas    # anywhere this Python sees it; without it that comparison is left out
    python benchmarks/twin_speed.py [--seconds 1]

Three discs of 0.3 m in a box, five sub-steps of 20 ms per step: `tight`, where discs always touch
somewhere in the batch, or `wide`, where they hardly do. Rates are million steps of a world (one
fleet under one hypothesis) a second; in brackets the share of worlds in touch, for who never
touches pays for no contacts. Rivals move rovers with the twin's content, or bare discs
(`twin_rivals.py`). Then the cost of a step against the number of vehicles, at constant density.
CPU time, best of several rounds.
"""

import argparse
import importlib.util
import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from twin_rivals import (
    START_M,
    STEP_S,
    PymunkDiscs,
    PymunkRovers,
    Subject,
    actions,
    pymunk_step,
    vmas_discs,
    vmas_rovers,
)

from base_station.belief.hypotheses import nominal
from base_station.twin import EAST, NORTH, FleetModel, advance_in_place, fault_rows, initial_state
from hil.airframe import OMNI_PLUS
from hil.scenario import load_scenario, station_view

RESCUE = Path(__file__).parents[1] / "scenarios" / "rescue.yaml"
BATCHES = (64, 1_024, 16_384)
FLEETS = (10, 20, 50, 100, 200, 500, 1_000)
ROUNDS = 5
SPACING_M = 0.62  # of discs of 0.3 m: some touch as they jostle
BOXES = {"tight": (0.3, 0.65), "wide": (4.2, 4.7)}  # half the room that centres have (m)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=1.0, help="of CPU time per measurement")
    round_s = parser.parse_args().seconds / ROUNDS
    torch.set_num_threads(1)
    print(
        "| box | batch | twin | VMAS, rovers | VMAS, discs | twin over VMAS: rovers, discs "
        "| twin over pymunk: rovers, discs |\n|---|---|---|---|---|---|---|"
    )
    for box, half_m in BOXES.items():
        gyms = [1.0 / cost_s(pymunk_step(e(half_m)), round_s) for e in (PymunkRovers, PymunkDiscs)]
        for batch in BATCHES:
            twin, ours = _rate(twin_box(batch, half_m), batch, round_s)
            theirs, over_vmas = ["-", "-"], "-"
            if importlib.util.find_spec("vmas"):
                rivals = [v(batch, half_m) for v in (vmas_rovers, vmas_discs)]
                rates, theirs = zip(*(_rate(r, batch, round_s) for r in rivals), strict=True)
                over_vmas = ", ".join(f"{twin / r:.2g}" for r in rates)
            over_pymunk = ", ".join(f"{twin / g:.0f}" for g in gyms)
            columns = (box, f"{batch:,}", ours, *theirs, over_vmas, over_pymunk)
            print(f"| {' | '.join(columns)} |", flush=True)
    print("\n| vehicles | us a step |\n|---|---|")
    costs = [cost_s(crowd(n).step, round_s) for n in FLEETS]
    for n, cost in zip(FLEETS, costs, strict=True):
        print(f"| {n:,} | {1e6 * cost:.1f} |")
    exponent = np.polyfit(np.log(FLEETS), np.log(costs), 1)[0]
    print(f"\ncost grows as N to the power of {exponent:.2f}")


def _rate(subject: Subject, batch: int, round_s: float) -> tuple[float, str]:
    """World steps per second, and that with the share in touch to print."""
    rate = batch / cost_s(subject.step, round_s)
    return rate, f"{rate / 1e6:.3f} ({100 * subject.touching():.0f} %)"


def cost_s(step: Callable[[], object], round_s: float) -> float:
    """CPU seconds per call, the best of some rounds."""
    step()
    calls, best = 1, math.inf
    for _ in range(ROUNDS + 8):
        started_s = time.thread_time()
        for _ in range(calls):
            step()
        took_s = time.thread_time() - started_s
        best = min(best, took_s / calls)
        calls = max(calls, min(8 * calls, round(round_s / best)))
    return best


def crowd(count: int) -> Subject:
    """One fleet of `count` vehicles in rows, all driving about at constant density."""
    side = math.ceil(math.sqrt(count))
    grid = SPACING_M * (np.stack(np.divmod(np.arange(count), side), axis=1) - 0.5 * (side - 1))
    half = 0.5 * SPACING_M * (side + 1)
    return twin(grid, 1, (half, half))


def twin_box(batch: int, half_m: tuple[float, float]) -> Subject:
    """`half_m` confines centres."""
    radius = OMNI_PLUS.radius_m
    return twin(np.array(START_M), batch, (half_m[0] + radius, half_m[1] + radius))


def twin(starts_m: np.ndarray, batch: int, half_m: tuple[float, float]) -> Subject:
    count = len(starts_m)
    view = station_view(load_scenario(RESCUE), 14550, 1)
    members = tuple(view.fleet[0].model_copy(update={"sysid": i + 1}) for i in range(count))
    model = FleetModel.from_view(view.model_copy(update={"fleet": members}))
    bounds = np.array([-half_m[0], half_m[0], -half_m[1], half_m[1]])
    model = FleetModel(model.sysids, model.vehicles._replace(bounds_m=bounds), model.nominal)
    states = initial_state(np.tile(starts_m, (batch, 1, 1)), np.zeros((batch, count)))
    faults = fault_rows(model, [nominal(1)])
    setpoints = np.full((batch, count, 3), np.nan)
    driven, walls = np.ones((batch, count), np.bool_), np.zeros((batch, count), np.bool_)
    impulses, following = np.empty((batch, 0, 0)), actions(batch, count)

    def step() -> None:
        setpoints[..., :2] = next(following)
        advance_in_place(
            model, model.nominal, faults, states, setpoints, driven, STEP_S, impulses, walls
        )

    return Subject(step, lambda: states[..., NORTH : EAST + 1])


if __name__ == "__main__":
    main()
