"""Experiments as they would be run: judged at the declared percentile, with what they predict."""

from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from base_station.planning.actors import Actor
from base_station.planning.policy import to_setpoints
from base_station.planning.requests import Contact, OpenLoopPlan, Prediction
from base_station.planning.tasks import evaluation
from base_station.planning.tasks.alpha import AlphaProblem, played
from base_station.planning.tasks.evaluation import DRAWS, PERCENTILE, Draws, plan_errors, predict
from base_station.planning.tasks.objectives import (
    CONTACT_COST,
    ENERGY_COST,
    TIME_COST,
    entropy,
    known_share,
)

Array = NDArray[np.float64]

CANDIDATES = 16  # looked at together; of a policy: its mode and 15 samples of it
TOUCH_SHARE = 1.0 - PERCENTILE  # of draws in which two vehicles touch, to call it a contact


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
        problem.limits,
        rng,
    )
    best = int(np.argmin(errors))
    return Candidate(float(errors[best]), plans[best])


def open_loop_plan(problem: AlphaProblem, found: Candidate) -> OpenLoopPlan:
    """The candidate with what each nominal twin expects the station to receive, and what it is
    expected to bring and to cost."""
    nominal = predict(
        problem.model,
        problem.model.nominal,
        problem.faults,
        problem.start[None],
        found.setpoints[None],
        problem.commands.driven,
        problem.period_s,
        problem.limits,
    )
    held = tuple(int(v) for v in np.flatnonzero(~problem.commands.driven))
    return OpenLoopPlan(
        found.setpoints,
        problem.period_s,
        held,
        found.error,
        nominal.reports[0],
        predicted(problem, found.setpoints),
    )


def predicted(problem: AlphaProblem, setpoints: Array) -> Prediction:
    """What set-points [K, V, 3] are expected to bring and to cost, over draws of what is unsure."""
    drawn = Draws.of(problem.model, problem.start, np.random.default_rng(DRAWS), DRAWS)
    seen = predict(
        problem.model,
        drawn.parameters,
        problem.faults,
        drawn.starts,
        np.repeat(setpoints[None], DRAWS, axis=0),
        problem.commands.driven,
        problem.period_s,
        problem.limits,
        contacts_too=True,
    )
    weights = np.asarray(problem.weights)
    moved = np.linalg.norm(seen.reports - seen.reports[:, :, :1], axis=-1, keepdims=True)
    squares = evaluation.pair_squares(seen.reports[:, :, 1:], moved[:, :, 1:])
    share, open_bits = known_share(squares, problem.weights), entropy(problem.weights) / log(2.0)
    shape = (DRAWS, len(weights), problem.model.size, problem.model.size)
    impulses = seen.contacts.impulses_ns.reshape(shape)
    speeds = seen.contacts.speeds_mps.reshape(shape).max(axis=1)
    total_ns = 0.5 * impulses.sum(axis=(2, 3)) @ weights
    duration_s = len(setpoints) * problem.period_s
    energy_j = float((seen.work_j @ weights).mean())
    cost = CONTACT_COST * float(total_ns.mean()) + TIME_COST * duration_s + ENERGY_COST * energy_j
    return Prediction(
        open_bits,
        float(share.mean()) * open_bits,
        float(np.quantile(share, 1.0 - PERCENTILE)) * open_bits,
        _contacts(problem, impulses.max(axis=1), speeds),
        duration_s,
        energy_j,
        cost,
    )


def _contacts(problem: AlphaProblem, impulses: Array, speeds: Array) -> tuple[Contact, ...]:
    """Who touches whom, of [D, V, V] over draws."""
    sysids, found = problem.model.sysids, list[Contact]()
    for a, b in zip(*np.triu_indices(len(sysids), 1), strict=True):
        if (impulses[:, a, b] > 0.0).mean() > TOUCH_SHARE:
            impulse = float(np.quantile(impulses[:, a, b], PERCENTILE))
            speed = float(np.quantile(speeds[:, a, b], PERCENTILE))
            found.append(Contact((sysids[a], sysids[b]), impulse, speed))
    return tuple(found)
