"""Random plans that keep going: a velocity per vehicle and stretch of two seconds."""

import numpy as np
from numpy.typing import NDArray

from base_station.planning.searches.search import ROUND, Proposals
from base_station.planning.tasks.alpha import AlphaProblem

Array = NDArray[np.float64]

STRETCH_S = 2.0


def shooting(problem: AlphaProblem, rng: np.random.Generator) -> Proposals:
    while True:
        knots = rng.uniform(-1.0, 1.0, (ROUND, stretches(problem), problem.commands.size))
        yield stretched(problem, knots)


def stretches(problem: AlphaProblem) -> int:
    return int(np.ceil(problem.steps * problem.period_s / STRETCH_S))


def stretched(problem: AlphaProblem, knots: Array) -> Array:
    """Actions [C, K, A] that hold each knot of [C, stretches, A] for a stretch."""
    which = np.arange(problem.steps) * stretches(problem) // problem.steps
    return knots[:, which]
