"""Where a mission policy is expected to take the fleet: shown before it is driven (pure)."""

import numpy as np
from numpy.typing import NDArray

from base_station.planning.tasks.beta import BetaProblem, Play
from base_station.twin import EAST, NORTH

Array = NDArray[np.float64]


def way(problem: BetaProblem, play: Play) -> Array:
    """Where the nominal twin goes under what is played until all have delivered, [K+1, V, 2]."""
    states, delivered = problem.start[None].copy(), problem.delivered[None].copy()
    places_m = [states[0, :, NORTH : EAST + 1].copy()]
    for k in range(problem.steps):
        if delivered.all():
            break
        actions = play(states, delivered, k)
        problem.move(problem.model.nominal, states, actions, np.ones(1, dtype=np.bool_))
        delivered |= problem.arrived(states)
        places_m.append(states[0, :, NORTH : EAST + 1].copy())
    return np.array(places_m)
