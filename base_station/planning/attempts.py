"""One try of a planner: what came out, whether it is good enough, and what it took."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.requests import OpenLoopPlan, PlanProgress, PlanRequest, Policy
from hil.scenario import StationView

Progress = Callable[[int, int, float], None]  # time steps, of so many, mean reward
OnProgress = Callable[[PlanProgress], None]


@dataclass(frozen=True)
class Attempt:
    """`accepted`: the target is met. `curve` rows are (timesteps, mean episode reward).

    `predicted_m` [K+1, V, 2] is where the policy takes the believed twin.
    """

    accepted: bool
    timesteps: int
    wall_s: float
    curve: tuple[tuple[float, float], ...]
    plan: OpenLoopPlan | None = None
    policy: Policy | None = None
    predicted_m: NDArray[np.float64] | None = None


Try = Callable[[StationView, PlanRequest, int, Progress], Attempt]  # the int is a seed
Attempts = Callable[[StationView, PlanRequest, OnProgress], tuple[Attempt, ...]]


def derived_seed(seed: int, attempt: int) -> int:
    """The seed of a restart: attempt k of a request always learns the same."""
    return int(np.random.SeedSequence([seed, attempt]).generate_state(1)[0] % 2**31)


def numbered(request: PlanRequest, k: int, on_progress: OnProgress) -> Progress:
    """What attempt `k` reports to, as messages for the station."""

    def progress(timesteps: int, total: int, mean_reward: float) -> None:
        on_progress(PlanProgress(request.number, request.kind, k, timesteps, total, mean_reward))

    return progress
