"""Open-loop planning without learning: a search proposes, the twin scores, the best is looked at.

A search is a generator: it yields action sequences [C, K, A], is sent what they earn on the nominal
twin [C], and may propose the next. A time step is one control period of one proposal, as in a
training; looks at the target are counted in neither.
"""

import time
from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray

from base_station.planning.attempts import Attempt, Progress
from base_station.planning.tasks.alpha import AlphaProblem, nominal_returns
from base_station.planning.tasks.candidates import (
    CANDIDATES,
    NOTHING,
    best_of,
    better,
    open_loop_plan,
)

Array = NDArray[np.float64]
Proposals = Generator[Array, Array, None]
Search = Callable[[AlphaProblem, np.random.Generator], Proposals]

ROUND = 64  # proposals at a time, for searches that don't mind
LOOK_EVERY = 8  # rounds


def search(
    problem: AlphaProblem,
    proposals: Search,
    seed: int,
    target_error: float,
    budget: int,
    progress: Progress,
) -> Attempt:
    """Until a candidate is as good as `target_error`, the search ends, or `budget` steps are up."""
    started, rng = time.perf_counter(), np.random.default_rng([seed, 1])
    running = proposals(problem, np.random.default_rng(seed))
    actions: Array | None = next(running)
    leaders, earned = np.empty((0, problem.steps, problem.commands.size)), np.empty(0)
    best, timesteps, curve, rounds = NOTHING, 0, list[tuple[float, float]](), 0
    while actions is not None:
        returns = nominal_returns(problem, actions)
        timesteps, rounds = timesteps + actions.shape[0] * actions.shape[1], rounds + 1
        curve.append((float(timesteps), float(returns.mean())))
        progress(timesteps, budget, curve[-1][1])
        leaders, earned = np.concatenate([leaders, actions]), np.concatenate([earned, returns])
        first = np.argsort(-earned, kind="stable")[:CANDIDATES]
        leaders, earned = leaders[first], earned[first]
        actions = _next(running, returns) if timesteps < budget else None
        if actions is None or rounds % LOOK_EVERY == 0:
            best = better(best, best_of(problem, leaders, rng))
            if best.error <= target_error:
                break
    took_s = time.perf_counter() - started
    accepted = best.error <= target_error
    return Attempt(accepted, timesteps, took_s, tuple(curve), open_loop_plan(problem, best))


def _next(running: Proposals, returns: Array) -> Array | None:
    """The next proposals, None when there are none."""
    try:
        return running.send(returns)
    except StopIteration:
        return None
