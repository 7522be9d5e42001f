"""The scripted rescue: drives what can drive, pushes what can't. It tells which layouts are
feasible, and what a learned policy must beat; it plans nothing and is not sent to vehicles.

The broken vehicle drives along its live axis until a push along the dead one leads to its goal. The
helper that is nearest to the place behind it goes there and pushes; whoever is in the way of the
broken one makes room; everybody else drives home, round the others and round obstacles. Where
an obstacle bars the way of the broken one, it is pushed first and drives then.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from base_station.planning.scripted.roads import Roads
from base_station.planning.scripted.steering import away_from_segment, steer
from base_station.planning.tasks.beta import BetaProblem, Play
from base_station.twin import EAST, NORTH

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CRAWL_MPS = 0.45  # a pusher needs a third of full speed to start
GAIN = 0.8  # m/s per m, of a push
ALIGNED_M = 0.05  # the broken one drives along its live axis first, to within this
HOME_GAIN = 1.5
GAP_M = 0.15  # between rims, on the way round others
BEHIND_M = 0.2  # between rims, of the place where a push begins
LATERAL_M = 0.08  # how well aligned a pusher must be
ROOM_M = 0.15  # that the way of the broken one is kept free by, beside its own width


@dataclass(frozen=True, eq=False)
class Scene:
    """What does not change during a mission: `roads` [V] round obstacles, for each vehicle."""

    problem: BetaProblem
    roads: tuple[Roads, ...]
    low: Array  # [V, 2] north, east: the corners that centres can reach
    high: Array

    @classmethod
    def of(cls, problem: BetaProblem) -> Self:
        vehicles = problem.model.vehicles
        bounds, radius = vehicles.bounds_m, vehicles.radius_m
        low, high = bounds[[0, 2]] + radius[:, None], bounds[[1, 3]] - radius[:, None]
        rows = zip(radius, low, high, strict=True)
        roads = tuple(Roads.of(vehicles.obstacles_m, float(r), *ends) for r, *ends in rows)
        return cls(problem, roads, low, high)


def push(problem: BetaProblem) -> Play:
    """The script: actions [E, A] for states [E, V, S] and what is `delivered` [E, V]; yaw stays as
    it is."""
    scene = Scene.of(problem)

    def play(states: Array, delivered: Flags, _k: int) -> Array:
        position = states[..., NORTH : EAST + 1]
        velocity = np.stack([_home(scene, position, delivered, v) for v in _all(problem)], axis=1)
        if problem.broken is not None and problem.blocked.any():
            _rescue(scene, problem.broken, position, delivered, velocity)
        speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
        velocity /= np.maximum(1.0, speed)
        commanded = velocity[:, problem.commands.commanded]
        if problem.commands.yaw_free:
            commanded = np.concatenate([commanded, np.zeros((*commanded.shape[:2], 1))], axis=-1)
        return np.asarray(commanded.reshape(len(states), -1))

    return play


def _all(problem: BetaProblem) -> range:
    return range(problem.model.size)


def _home(scene: Scene, position: Array, delivered: Flags, v: int) -> Array:
    """Vehicle `v` to its goal [E, 2]; who has delivered stays."""
    goal = np.broadcast_to(scene.problem.goals_m[v], position[:, v].shape)
    return _round(scene, position, v, goal) * ~delivered[:, v, None]


def _round(scene: Scene, position: Array, v: int, target: Array) -> Array:
    """Vehicle `v` to `target` [E, 2], round all others and obstacles."""
    radius, low, high = scene.problem.model.vehicles.radius_m, scene.low[v], scene.high[v]
    others = [k for k in _all(scene.problem) if k != v]
    target = scene.roads[v].towards(position[:, v], target)
    if not others:
        return HOME_GAIN * (target - position[:, v])
    clear = radius[v] + radius[others] + GAP_M
    target = np.clip(target, low + 0.02, high - 0.02)
    return steer(position[:, v], target, position[:, others], clear, low, high)


def _rescue(scene: Scene, broken: int, position: Array, delivered: Flags, velocity: Array) -> None:
    """Overwrite the velocities of the broken vehicle, its pusher, and whoever is in the way."""
    problem = scene.problem
    rows, radius = np.arange(len(position)), problem.model.vehicles.radius_m
    here = position[:, broken]
    way = problem.goals_m[broken] - here
    blocked = way @ problem.blocked
    free = way - blocked
    left = np.linalg.norm(blocked, axis=1, keepdims=True)
    direction = blocked / np.maximum(left, 1e-9)
    helpers = np.array([v for v in problem.commands.commanded if v != broken])
    if not len(helpers):
        return
    reach = float(radius[broken] + radius[helpers].max())
    wanted = ~delivered[:, broken] & (left[:, 0] > 0.5 * problem.radius_m)
    at_once = wanted & _barred_by_turn(scene.roads[broken], here, free, blocked)
    free = np.where(at_once[:, None], 0.0, free)
    turn = here + free  # from here on it is pushed
    spot = turn - (reach + BEHIND_M) * direction
    pusher = helpers[np.linalg.norm(position[:, helpers] - spot[:, None], axis=-1).argmin(axis=1)]
    velocity[~delivered[:, broken], broken] = HOME_GAIN * free[~delivered[:, broken]]
    velocity[delivered[:, broken], broken] = 0.0
    aligned = np.linalg.norm(free, axis=1) <= ALIGNED_M
    speed = np.clip(GAIN * left, CRAWL_MPS, 1.0)
    offset = position[rows, pusher] - here
    along = (offset * direction).sum(axis=1, keepdims=True)
    across = offset - along * direction
    ready = aligned & (along[:, 0] < 0.0) & (np.linalg.norm(across, axis=1) <= LATERAL_M)
    shove = speed * direction - HOME_GAIN * across
    for v in helpers:
        _make_room(position, v, here, turn, problem.goals_m[broken], reach, wanted, velocity)
        mine = wanted & (pusher == v)
        velocity[mine, v] = _round(scene, position, v, spot)[mine]
        velocity[mine & ready, v] = shove[mine & ready]


def _barred_by_turn(roads: Roads, here: Array, free: Array, blocked: Array) -> Flags:
    """Is the way barred that drives first and is pushed then, and free the other way round [E]?"""
    first, second = (
        roads.barred(here, here + leg) | roads.barred(here + leg, here + free + blocked)
        for leg in (free, blocked)
    )
    return np.asarray(first & ~second)


def _make_room(
    position: Array,
    v: int,
    here: Array,
    turn: Array,
    goal: Array,
    reach_m: float,
    wanted: Flags,
    velocity: Array,
) -> None:
    """Vehicle `v` leaves the way of the broken one: from `here` to `turn` [E, 2] to its goal."""
    for start, end in ((here, turn), (turn, np.broadcast_to(goal, turn.shape))):
        away, distance = away_from_segment(position[:, v], start, end)
        close = wanted & (distance < reach_m + ROOM_M)
        velocity[close, v] = away[close]
