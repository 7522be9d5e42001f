"""The cross-entropy method: a normal distribution of plans, drawn towards its best samples."""

import numpy as np

from base_station.planning.searches.search import ROUND, Proposals
from base_station.planning.searches.shooting import stretched, stretches
from base_station.planning.tasks.alpha import AlphaProblem

ELITES = 8
SIGMA = 0.7  # at first
SIGMA_MIN = 0.05
FOLLOW = 0.7  # of the way to the elites' mean and spread, a round


def cem(problem: AlphaProblem, rng: np.random.Generator) -> Proposals:
    """Over the same stretches as `shooting`."""
    shape = (stretches(problem), problem.commands.size)
    mean, sigma = np.zeros(shape), np.full(shape, SIGMA)
    while True:
        knots = np.clip(mean + sigma * rng.standard_normal((ROUND, *shape)), -1.0, 1.0)
        returns = yield stretched(problem, knots)
        elites = knots[np.argsort(-returns, kind="stable")[:ELITES]]
        mean = mean + FOLLOW * (elites.mean(axis=0) - mean)
        sigma = np.maximum(sigma + FOLLOW * (elites.std(axis=0) - sigma), SIGMA_MIN)
