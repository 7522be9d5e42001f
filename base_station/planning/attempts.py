"""One try of a planner: what came out, whether it is good enough, and what it took."""

from collections.abc import Callable
from dataclasses import dataclass

from base_station.planning.requests import OpenLoopPlan, PolicyWeights

Progress = Callable[[int, int, float], None]  # time steps, of so many, mean reward


@dataclass(frozen=True)
class Attempt:
    """`accepted`: the target is met. `curve` rows are (timesteps, mean episode reward)."""

    accepted: bool
    timesteps: int
    wall_s: float
    curve: tuple[tuple[float, float], ...]
    plan: OpenLoopPlan | None = None
    policy: PolicyWeights | None = None
