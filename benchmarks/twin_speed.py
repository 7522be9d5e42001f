"""How fast is the twin? Ratios from one run, on one thread.

    pip install vmas    # anywhere this Python sees it; without it that comparison is left out
    python benchmarks/twin_speed.py [--seconds 1]

Three discs of 0.3 m in a box, five sub-steps of 20 ms per step: `tight`, where discs always touch
somewhere in the batch, or `wide`, where they hardly do. Who never touches pays for no contacts, so
the share of worlds in touch is printed. A world step is one such step of one fleet under one
hypothesis; the twin's includes autopilot and motors. Then the cost of a step against the number of
vehicles, at constant density. CPU time, best of several rounds.
"""

import argparse
import importlib.util
import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import gymnasium
import numpy as np
import pymunk
import torch

from base_station.hypotheses import nominal
from base_station.twin import EAST, NORTH, FleetModel, advance_in_place, fault_rows, initial_state
from hil.airframe import OMNI_PLUS
from hil.scenario import load_scenario, station_view

RESCUE = Path(__file__).parents[1] / "scenarios" / "rescue.yaml"
BATCHES = (64, 1_024, 16_384)
FLEETS = (10, 20, 50, 100, 200, 500, 1_000)
SUB_STEPS = 5
STEP_S = 0.1
ROUNDS = 5
SPACING_M = 0.62  # of discs of 0.3 m: some touch as they jostle
FORCE_N = 30.0
BOXES = {"tight": (0.3, 0.65), "wide": (4.2, 4.7)}  # half the room that centres have (m)
START_M = ((0.0, -0.65), (0.0, 0.0), (0.0, 0.65))


@dataclass(frozen=True)
class Subject:
    """What is measured: a step, and where the discs are [B, V, 2] (m) after those taken."""

    step: Callable[[], object]
    positions: Callable[[], np.ndarray]

    def touching(self) -> float:
        """The share of worlds in which two discs touch, within 5 mm."""
        at = self.positions()
        pairs = np.triu_indices(at.shape[1], 1)
        gaps = np.linalg.norm(at[:, pairs[0]] - at[:, pairs[1]], axis=-1)
        return float((gaps < 2.0 * OMNI_PLUS.radius_m + 0.005).any(axis=1).mean())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=1.0, help="of CPU time per measurement")
    round_s = parser.parse_args().seconds / ROUNDS
    torch.set_num_threads(1)
    print(
        "| box | batch | twin, million world steps/s (in touch) | VMAS (in touch) "
        "| twin over VMAS | pymunk in Gymnasium, thousand/s | twin over pymunk |"
        "\n|---|---|---|---|---|---|---|"
    )
    for box, half_m in BOXES.items():
        gym = 1.0 / cost_s(pymunk_step(half_m), round_s)
        for batch in BATCHES:
            twin, ours = _rate(twin_box(batch, half_m), batch, round_s)
            vmas, theirs = 0.0, "-"
            if importlib.util.find_spec("vmas"):
                vmas, theirs = _rate(vmas_box(batch, half_m), batch, round_s)
            ratio = f"{twin / vmas:.2g}" if vmas else "-"
            print(
                f"| {box} | {batch:,} | {ours} | {theirs} | {ratio} "
                f"| {gym / 1e3:.0f} | {twin / gym:.0f} |",
                flush=True,
            )
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
    impulses, actions = np.empty((batch, 0, 0)), itertools.cycle(_actions(batch, count))

    def step() -> None:
        setpoints[..., :2] = next(actions)
        advance_in_place(
            model, model.nominal, faults, states, setpoints, driven, STEP_S, impulses, walls
        )

    return Subject(step, lambda: states[..., NORTH : EAST + 1])


def _actions(batch: int, count: int) -> list[np.ndarray]:
    """A few random actions [B, V, 2] in [-1, 1], each five times running."""
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(-1.0, 1.0, (batch, count, 2)) for _ in range(6)]
    return [action for action in drawn for _ in range(5)]


def vmas_box(batch: int, half_m: tuple[float, float]) -> Subject:
    from vmas.simulator.core import Agent, Sphere, World

    cpu = torch.device("cpu")
    sides = {"x_semidim": half_m[0], "y_semidim": half_m[1]}
    world = World(batch, cpu, dt=STEP_S, substeps=SUB_STEPS, **sides)
    for i, place in enumerate(START_M):
        shape = Sphere(OMNI_PLUS.radius_m)
        agent = Agent(f"rover_{i}", shape=shape, mass=OMNI_PLUS.mass_kg, rotatable=False)
        world.add_agent(agent)
        agent.state.pos = torch.tensor([place] * batch, dtype=torch.float32)
    forces = [torch.tensor(FORCE_N * a, dtype=torch.float32) for a in _actions(batch, 3)]
    following, still = itertools.cycle(forces), torch.zeros((batch, 1))

    def step() -> None:
        force = next(following)
        for i, agent in enumerate(world.agents):
            agent.state.force, agent.state.torque = force[:, i], still
        world.step()

    def positions() -> np.ndarray:
        return torch.stack([a.state.pos for a in world.agents], dim=1).numpy()

    return Subject(step, positions)


class _PymunkEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """What one would write first: a space of discs behind `step`."""

    def __init__(self, half_m: tuple[float, float]) -> None:
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (12,))
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (6,))
        self._space = pymunk.Space()
        self._space.damping = 0.5
        self._bodies = []
        for place in START_M:
            body = pymunk.Body(OMNI_PLUS.mass_kg, math.inf)
            body.position = place
            self._space.add(body, pymunk.Circle(body, OMNI_PLUS.radius_m))
            self._bodies.append(body)
        x, y = half_m[0] + OMNI_PLUS.radius_m, half_m[1] + OMNI_PLUS.radius_m
        for a, b in itertools.pairwise([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)]):
            self._space.add(pymunk.Segment(self._space.static_body, a, b, 0.0))

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, object]]:
        for _ in range(SUB_STEPS):
            for i, body in enumerate(self._bodies):
                body.force = float(action[2 * i]), float(action[2 * i + 1])
            self._space.step(STEP_S / SUB_STEPS)
        rows = [(*b.position, *b.velocity) for b in self._bodies]
        observation = np.array(rows, dtype=np.float32).ravel()
        return observation, float(-np.abs(observation[:6]).sum()), False, False, {}


def pymunk_step(half_m: tuple[float, float]) -> Callable[[], object]:
    env = _PymunkEnv(half_m)
    actions = itertools.cycle([FORCE_N * a.ravel() for a in _actions(1, 3)])
    return lambda: env.step(next(actions))


if __name__ == "__main__":
    main()
