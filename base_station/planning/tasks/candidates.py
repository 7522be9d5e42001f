"""Experiments as they would be run: judged at the declared percentile, with what they predict."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.actors import Actor
from base_station.planning.policy import to_setpoints
from base_station.planning.requests import OpenLoopPlan
from base_station.planning.tasks.alpha import AlphaProblem, played
from base_station.planning.tasks.evaluation import plan_errors, predict

Array = NDArray[np.float64]

CANDIDATES = 16  # looked at together; of a policy: its mode and 15 samples of it


@dataclass(frozen=True, eq=False)
class Candidate:
    """The best plan found by a look; NOTHING before the first."""

    error: float
    setpoints: Array  # [K, V, 3]


NOTHING = Candidate(np.inf, np.empty(0))


def better(one: Candidate, other: Candidate) -> Candidate:
    """The one with the smaller error; the first of equals."""
    return min(one, other, key=lambda c: c.error)


def best_candidate(problem: AlphaProblem, actor: Actor, seed: int) -> Candidate:
    """The best at the declared percentile among the policy's mode and samples of it."""
    rng = np.random.default_rng([seed, 1])
    return best_of(problem, played(problem, actor, CANDIDATES, rng), rng)


def best_of(problem: AlphaProblem, actions: Array, rng: np.random.Generator) -> Candidate:
    """The best at the declared percentile among action sequences [C, K, A]."""
    plans = to_setpoints(actions, problem.commands)
    errors = plan_errors(
        problem.model,
        problem.faults,
        problem.start,
        plans,
        problem.commands.driven,
        problem.period_s,
        rng,
    )
    best = int(np.argmin(errors))
    return Candidate(float(errors[best]), plans[best])


def open_loop_plan(problem: AlphaProblem, found: Candidate) -> OpenLoopPlan:
    """The candidate with what each nominal twin expects the station to receive."""
    nominal = predict(
        problem.model,
        problem.model.nominal,
        problem.faults,
        problem.start[None],
        found.setpoints[None],
        problem.commands.driven,
        problem.period_s,
    )
    held = tuple(int(v) for v in np.flatnonzero(~problem.commands.driven))
    return OpenLoopPlan(found.setpoints, problem.period_s, held, found.error, nominal.reports[0])
