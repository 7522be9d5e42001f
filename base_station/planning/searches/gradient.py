"""Ascent along finite differences of what a plan earns.

Where nothing touches, the twins agree, the differences are zero, and it has nowhere to go: the
paper's argument for reinforcement learning. Numbers in docs/reproduction.md.
"""

import numpy as np

from base_station.planning.searches.search import Proposals
from base_station.planning.tasks.alpha import AlphaProblem

SPREAD = 0.3  # of the first plan's actions
DIFFERENCE = 0.05
STRIDE = 0.3  # length of a step in the largest action


def gradient(problem: AlphaProblem, rng: np.random.Generator) -> Proposals:
    """Ends where the gradient vanishes."""
    shape = (problem.steps, problem.commands.size)
    plan = np.clip(SPREAD * rng.standard_normal(shape), -1.0, 1.0)
    nudges = DIFFERENCE * np.eye(plan.size).reshape(plan.size, *shape)
    while True:
        returns = yield np.concatenate([plan[None], plan + nudges])
        slope = (returns[1:] - returns[0]).reshape(shape) / DIFFERENCE
        steepest = np.abs(slope).max()
        if steepest == 0.0:
            return
        plan = np.clip(plan + STRIDE * slope / steepest, -1.0, 1.0)
