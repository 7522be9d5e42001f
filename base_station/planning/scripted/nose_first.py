"""A mission by rule, for fleets that turn before they drive: go home, or push who can't drive.

Every vehicle turns on the spot until it looks where it wants to go, and drives only then. One that
has no drive is pushed along its rolling axis, by the helper that is nearest to the place behind it;
where that axis does not lead, nobody can push it. No learning: PPO found no policy for such fleets
within ten minutes. Whether the rule does is tried on the twin before it is driven.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import Commands
from base_station.planning.scripted.steering import away_from_segment, steer
from base_station.twin import EAST, NORTH, YAW, FaultArrays, FleetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LOOKS_RAD = 0.25  # off its bearing by less than this, it drives; it turns by more
SLOWEST = 0.25  # share of the speed: less does not overcome rolling resistance for sure
APPROACH = 0.8  # share of the speed per metre to go
STAND_OFF_M = 0.4  # between rims, where a push begins
AT_SPOT_M = 0.12
LATERAL_M = 0.14  # how well aligned it must be to push ...
LOST_M = 0.2  # ... and how far off the line it may get while it does
LINE_GAIN = 1.2  # rad of heading per metre off the line
PUSH_SHARE, CRAWL = 0.5, 0.3  # of the speed: of a push, far from the goal and near
EASE = 0.5  # share of the speed per metre to go, in between
ROOM_M = 0.2  # beside the way of who is pushed
GAP_M = 0.25


@dataclass(frozen=True, eq=False)
class Scene:
    """What the rule looks at. `helpless`: the broken vehicle has no drive."""

    model: FleetModel
    goals_m: Array
    commands: Commands
    radius_m: float
    broken: int | None
    helpless: bool


def without_drive(model: FleetModel, faults: FaultArrays, v: int | None) -> bool:
    """Whether no motor of vehicle `v` pulls under the first hypothesis of `faults`."""
    if v is None:
        return False
    there = model.nominal.stall_force_n[0, v] > 0.0
    return bool((faults.power[0, v][there] < 0.5).all())


def nose_first(scene: Scene, states: Array, delivered: Flags) -> Array:
    """Actions [E, A] for states [E, V, S] and what is `delivered` [E, V]."""
    rows, count = states.shape[:2]
    actions = np.zeros((rows, count, 3))
    actions[..., 2] = states[..., YAW] / np.pi
    position = states[..., NORTH : EAST + 1]
    pusher = np.full(rows, -1)
    wanted = np.zeros(rows, dtype=np.bool_)
    if scene.broken is not None and scene.helpless and count > 1:
        pusher, wanted = _push(scene, states, delivered, actions)
    for v in range(count):
        mine = ~delivered[:, v] & ~(wanted & (pusher == v))
        if v == scene.broken and scene.helpless:
            continue
        target = np.broadcast_to(scene.goals_m[v], (rows, 2))
        velocity = _round(scene, position, v, target)
        if scene.broken is not None and scene.helpless:
            velocity = _clear_of_push(scene, position, v, velocity, wanted)
            mine |= wanted & (pusher != v) & _in_the_way(scene, position, v)
        _turn_then_drive(states, v, velocity, mine, actions)
    return actions[:, scene.commands.commanded].reshape(rows, -1)


def _turn_then_drive(states: Array, v: int, velocity: Array, which: Flags, actions: Array) -> None:
    speed = np.linalg.norm(velocity, axis=1)
    bearing = np.arctan2(velocity[:, 1], velocity[:, 0])
    off = np.abs(_wrapped(bearing - states[:, v, YAW]))
    go = which & (speed > 1e-6)
    drives = go & (off < LOOKS_RAD)
    share = np.clip(speed, SLOWEST, 1.0) / np.maximum(speed, 1e-9)
    actions[go, v, 2] = bearing[go] / np.pi
    actions[drives, v, :2] = (velocity * share[:, None])[drives]


def _push(
    scene: Scene, states: Array, delivered: Flags, actions: Array
) -> tuple[NDArray[np.intp], Flags]:
    """Who pushes [E], and in which environments it is still wanted; fills in their actions."""
    model, broken = scene.model, scene.broken
    assert broken is not None
    rows = np.arange(len(states))
    position, radius = states[..., NORTH : EAST + 1], model.vehicles.radius_m
    here, yaw = position[:, broken], states[:, broken, YAW]
    axis = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
    left = ((scene.goals_m[broken] - here) * axis).sum(axis=1)
    direction = axis * np.where(left >= 0.0, 1.0, -1.0)[:, None]
    left = np.abs(left)
    wanted = ~delivered[:, broken] & (left > 0.3 * scene.radius_m)
    helpers = np.array([v for v in scene.commands.commanded if v != broken])
    reach = float(radius[broken] + radius[helpers].max())
    spot = here - (reach + STAND_OFF_M) * direction
    way = np.linalg.norm(position[:, helpers] - spot[:, None], axis=-1)
    pusher = helpers[way.argmin(axis=1)]
    offset = position[rows, pusher] - here
    along = (offset * direction).sum(axis=1)
    side = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    across = (offset * side).sum(axis=1)
    towards = np.arctan2(direction[:, 1], direction[:, 0])
    behind = along < -0.8 * reach
    looks = np.abs(_wrapped(towards - states[rows, pusher, YAW])) < LOOKS_RAD
    touching = -along < reach + 0.1
    lined_up = (
        behind
        & (np.abs(across) < np.where(touching, LOST_M, LATERAL_M))
        & (-along < reach + 2.0 * STAND_OFF_M)
    )
    heading = towards - np.clip(LINE_GAIN * across, -LOOKS_RAD, LOOKS_RAD)
    speed = np.where(touching, np.clip(EASE * left, CRAWL, PUSH_SHARE), CRAWL)
    for v in helpers:
        mine = wanted & (pusher == v)
        _turn_then_drive(states, v, _round(scene, position, v, spot), mine & ~lined_up, actions)
        turns, drives = mine & lined_up, mine & lined_up & looks
        actions[turns, v, :2] = 0.0
        actions[turns, v, 2] = _wrapped(heading)[turns] / np.pi
        nose = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        actions[drives, v, :2] = (speed[:, None] * nose)[drives]
    return pusher, wanted


def _round(scene: Scene, position: Array, v: int, target: Array) -> Array:
    """A velocity (share of the speed) to `target` [E, 2], round all others; zero when there."""
    bounds, radius = scene.model.vehicles.bounds_m, scene.model.vehicles.radius_m
    low, high = bounds[[0, 2]] + radius[v] + 0.02, bounds[[1, 3]] - radius[v] - 0.02
    target = np.clip(target, low, high)
    others = [k for k in range(position.shape[1]) if k != v]
    way = target - position[:, v]
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    velocity = way
    if others:
        clear = radius[v] + radius[others] + GAP_M
        velocity = steer(position[:, v], target, position[:, others], clear, low, high)
    size = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), 1e-9)
    speed = np.clip(APPROACH * distance, SLOWEST, 1.0)
    there = distance < min(AT_SPOT_M, 0.6 * scene.radius_m)
    return np.asarray(np.where(there, 0.0, velocity / size * speed))


def _lane(scene: Scene, position: Array, v: int) -> tuple[Array, Array, float]:
    """Away from the way of the broken vehicle [E, 2], how far from it [E], and what is enough."""
    assert scene.broken is not None
    radius = scene.model.vehicles.radius_m
    here = position[:, scene.broken]
    goal = np.broadcast_to(scene.goals_m[scene.broken], here.shape)
    away, distance = away_from_segment(position[:, v], here, goal)
    return away, distance, float(radius[v] + radius[scene.broken] + ROOM_M)


def _in_the_way(scene: Scene, position: Array, v: int) -> Flags:
    _, distance, enough = _lane(scene, position, v)
    return np.asarray(distance < enough)


def _clear_of_push(scene: Scene, position: Array, v: int, velocity: Array, wanted: Flags) -> Array:
    """While a push is wanted, who is in its way leaves it first."""
    away, distance, enough = _lane(scene, position, v)
    close = wanted & (distance < enough)
    return np.where(close[:, None], 0.6 * away, velocity)


def _wrapped(angle_rad: Array) -> Array:
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)
