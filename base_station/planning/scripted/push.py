"""The scripted rescue: drives what can drive, pushes what can't. It tells which layouts are
feasible, and what a learned policy must beat; it plans nothing and is not sent to vehicles."""

import numpy as np
from numpy.typing import NDArray

from base_station.planning.scripted.around import get_behind
from base_station.planning.tasks.beta import BetaProblem
from base_station.twin import EAST, NORTH

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CRAWL_MPS = 0.45  # a pusher needs a third of full speed to start
GAIN = 0.8  # m/s per m, of a push
ALIGNED_M = 0.05  # the broken one drives along its good axis first, to within this
HOME_GAIN = 1.5
CLOSE_M = 1.0  # the way home goes round others that are closer
SWERVE = 1.2


def push(problem: BetaProblem, states: Array, delivered: Flags) -> Array:
    """Actions [E, A] for states [E, V, S] and what is `delivered` [E, V]; yaw stays as it is."""
    position = states[..., NORTH : EAST + 1]
    velocity = _home(problem, position, delivered)
    if problem.broken is not None and problem.blocked.any():
        _rescue(problem, position, delivered, velocity)
    speed = np.linalg.norm(velocity, axis=-1, keepdims=True)
    velocity /= np.maximum(1.0, speed)
    return velocity[:, problem.commands.commanded].reshape(len(states), -1)


def _home(problem: BetaProblem, position: Array, delivered: Flags) -> Array:
    """Everybody to the goal [E, V, 2], swerving to the right of who is in the way."""
    way = problem.goals_m - position
    velocity = HOME_GAIN * way * ~delivered[..., None]
    length = np.maximum(np.linalg.norm(way, axis=-1, keepdims=True), 1e-9)
    heading = way / length
    right = np.stack([-heading[..., 1], heading[..., 0]], axis=-1)
    for other in range(problem.model.size):
        offset = position[:, other, None] - position
        distance = np.linalg.norm(offset, axis=-1, keepdims=True)
        ahead = (offset * heading).sum(axis=-1, keepdims=True)
        near = (ahead > 0.0) & (distance < CLOSE_M) & (ahead < length) & (distance > 0.0)
        velocity += SWERVE * right * (near & ~delivered[..., None])
    return velocity


def _rescue(problem: BetaProblem, position: Array, delivered: Flags, velocity: Array) -> None:
    """Overwrite the velocities of the broken vehicle and of its pusher while it is not home."""
    broken = problem.broken
    assert broken is not None
    rows, radius = np.arange(len(position)), problem.model.vehicles.radius_m
    way = problem.goals_m[broken] - position[:, broken]
    blocked = way @ problem.blocked
    free = way - blocked
    left = np.linalg.norm(blocked, axis=1, keepdims=True)
    direction = blocked / np.maximum(left, 1e-9)
    helpers = np.array([v for v in problem.commands.commanded if v != broken])
    behind = (position[:, broken, None] - position[:, helpers]) @ direction[..., None]
    pusher = helpers[np.argmax(behind[..., 0], axis=1)]
    reach = float(radius[broken] + radius[helpers].max())
    drive, ready = get_behind(position[rows, pusher], position[:, broken], direction, reach)
    aligned = np.linalg.norm(free, axis=1) <= ALIGNED_M
    speed = np.clip(GAIN * left, CRAWL_MPS, 1.0)
    offset = position[rows, pusher] - position[:, broken]
    across = offset - (offset * direction).sum(axis=1, keepdims=True) * direction
    shove = speed * direction - HOME_GAIN * across
    drive = np.where((ready & aligned)[:, None], shove, drive)
    open_ = ~delivered[:, broken] & (left[:, 0] > 0.5 * problem.radius_m)
    velocity[rows[open_], pusher[open_]] = drive[open_]
    velocity[open_, broken] = HOME_GAIN * free[open_]
