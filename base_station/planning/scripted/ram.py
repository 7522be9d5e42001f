"""Scripted experiments: get behind the suspect and drive into it. They tell what is feasible."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import to_setpoints
from base_station.planning.scripted.around import get_behind
from base_station.planning.scripted.roads import Roads
from base_station.planning.searches.search import Proposals
from base_station.planning.tasks.alpha import AlphaProblem
from base_station.twin import EAST, NORTH

Array = NDArray[np.float64]

DIRECTIONS = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
PUSHES_S = (1.0, 2.0, 3.0)
TOUCH_M = 0.1
GAIN = 1.5  # m/s per m


def ram(problem: AlphaProblem, rng: np.random.Generator) -> Proposals:  # noqa: ARG001
    """Each helper into the suspect from each side, for as long as that takes in the first twin."""
    helpers = [v for v in problem.commands.commanded if v != problem.suspect]
    if helpers:
        yield np.array([_script(problem, *how) for how in product(helpers, DIRECTIONS, PUSHES_S)])


def _script(
    problem: AlphaProblem, helper: int, direction: tuple[float, float], push_s: float
) -> Array:
    """Actions [K, A]: the drive of one helper in the nominal twin, as it went."""
    commands, vehicles = problem.commands, problem.model.vehicles
    radius = vehicles.radius_m
    slot = commands.size // len(commands.commanded) * commands.commanded.index(helper)
    states = problem.start[None].copy()
    memory = problem.objective.begin(problem.reports(states))
    actions = np.zeros((problem.steps, commands.size))
    low, high = (
        vehicles.bounds_m[[0, 2]] + radius[helper],
        vehicles.bounds_m[[1, 3]] - radius[helper],
    )
    roads = Roads.of(vehicles.obstacles_m, float(radius[helper]), low, high)
    reach = float(radius[helper] + radius[problem.suspect])
    left = pushes = round(push_s / problem.period_s)
    way = np.array([direction])
    for k in range(problem.steps):
        position = states[:, 0, :, NORTH : EAST + 1]
        here, there = position[:, helper], position[:, problem.suspect]
        place, ready = get_behind(here, there, way, reach)
        velocity = GAIN * (roads.towards(here, place) - here)
        touches = np.linalg.norm(here - there) <= reach + TOUCH_M
        if left < pushes or (ready[0] and touches):
            velocity, left = way * (left > 0), left - 1
        elif ready[0]:
            velocity = way
        speed = max(1.0, float(np.linalg.norm(velocity)))
        actions[k, slot : slot + 2] = velocity[0] / speed
        setpoints = to_setpoints(actions[None, k], commands)
        problem.move(problem.model.nominal, states, memory, setpoints)
    return actions
