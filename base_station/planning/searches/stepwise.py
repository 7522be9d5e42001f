"""Random actions, a new one every control period: what exploration without memory comes to."""

import numpy as np

from base_station.planning.searches.search import ROUND, Proposals
from base_station.planning.tasks.alpha import AlphaProblem


def stepwise(problem: AlphaProblem, rng: np.random.Generator) -> Proposals:
    while True:
        yield rng.uniform(-1.0, 1.0, (ROUND, problem.steps, problem.commands.size))
