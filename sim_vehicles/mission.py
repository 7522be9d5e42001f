"""Missions: items to targets, and the progress through them (pure; NED, m, s).

Item 0 is home, as in ArduPilot; a mission runs from item 1. A way-point at latitude and longitude
0 means "where the vehicle is".
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hil.frames import Origin, wgs84_to_ned
from hil.mavlink import Command, GlobalFrame, MissionItem, MissionResult, MissionState, MissionType
from sim_vehicles.fence import CIRCLES, POLYGONS

Point = tuple[float, float]
MAX_DISTANCE_M = 100_000.0
_IN_A_LIST = {
    MissionType.MISSION: frozenset(
        {
            Command.NAV_WAYPOINT,
            Command.NAV_LOITER_UNLIM,
            Command.NAV_RETURN_TO_LAUNCH,
            Command.NAV_DELAY,
            Command.DO_CHANGE_SPEED,
        }
    ),
    MissionType.FENCE: frozenset({*POLYGONS, *CIRCLES, Command.NAV_FENCE_RETURN_POINT}),
    MissionType.RALLY: frozenset({Command.NAV_RALLY_POINT}),
}
_IN_THE_AIR = frozenset({Command.NAV_TAKEOFF, Command.NAV_LAND})  # for what flies
_WITHOUT_PLACE = frozenset(
    {
        Command.NAV_RETURN_TO_LAUNCH,
        Command.NAV_DELAY,
        Command.DO_CHANGE_SPEED,
        Command.NAV_TAKEOFF,  # straight up, as ArduPilot does
    }
)
_WITHOUT_MOTION = frozenset({Command.NAV_DELAY, Command.DO_CHANGE_SPEED})
_WITH_HEIGHT = frozenset({Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_TAKEOFF})
_TO_THE_GROUND = frozenset({Command.NAV_LAND, Command.NAV_RETURN_TO_LAUNCH})
_ABOVE_SEA = frozenset({GlobalFrame.GLOBAL, GlobalFrame.GLOBAL_INT})
HEIGHT_REACHED_M = 0.3


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a mission is. `arrived_s` is when the current item's place was reached."""

    seq: int = 1
    arrived_s: float | None = None
    speed_mps: float | None = None
    started: bool = False
    complete: bool = False


@dataclass(frozen=True, slots=True)
class Advance:
    """The next progress, the point to drive to (None: stay), and the items done on the way.

    `down_m` is the height to go to (None: as it is), for what flies.
    """

    progress: Progress
    goal_m: Point | None = None
    down_m: float | None = None
    lifts: bool = False
    lands: bool = False
    reached: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Air:
    """Where what flies is, and its home: NED down (m)."""

    here_down_m: float
    home_down_m: float
    landed: bool


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What progress depends on."""

    now_s: float
    here_m: Point
    home_m: Point
    origin: Origin
    radius_m: float  # WP_RADIUS
    air: Air | None = None
    return_height_m: float = 0.0  # RTL_ALT


def advance(items: Sequence[MissionItem], progress: Progress, around: Surroundings) -> Advance:
    """Do what is due of the mission at this moment."""
    reached: list[int] = []
    progress = replace(progress, started=True)
    while progress.seq < len(items) and not progress.complete:
        item = items[progress.seq]
        goal_m = goal_of(item, around)
        progress = _arrive(item, progress, goal_m, around)
        if not _is_done(item, progress, around):
            return _towards(item, progress, around, tuple(reached))
        reached.append(progress.seq)
        speed = item.params[1] if item.command == Command.DO_CHANGE_SPEED else None
        progress = Progress(progress.seq + 1, None, speed or progress.speed_mps, started=True)
    ended = replace(progress, seq=max(0, len(items) - 1), complete=True)
    if len(items) <= 1:
        return Advance(ended, reached=tuple(reached))
    return _towards(items[-1], ended, around, tuple(reached))


def _towards(
    item: MissionItem, progress: Progress, around: Surroundings, reached: tuple[int, ...]
) -> Advance:
    goal_m = goal_of(item, around)
    if around.air is None:
        return Advance(progress, goal_m, reached=reached)
    lands = item.command in _TO_THE_GROUND and progress.arrived_s is not None
    lifts = item.command == Command.NAV_TAKEOFF and not progress.complete
    down_m = down_of(item, around.air, around.origin)
    return Advance(progress, goal_m, down_m, lifts, lands, reached)


def down_of(item: MissionItem, air: Air, origin: Origin) -> float | None:
    """The height that an item wants, as NED down (m); None for that which it has."""
    if item.command not in _WITH_HEIGHT:
        return None
    return (origin.alt_m if item.frame in _ABOVE_SEA else air.home_down_m) - item.z


def goal_of(item: MissionItem, around: Surroundings) -> Point | None:
    """Where an item wants the vehicle; None where it is."""
    if item.command == Command.NAV_RETURN_TO_LAUNCH:
        return around.home_m
    if item.command in _WITHOUT_PLACE or (item.x, item.y) == (0, 0):
        return None
    return wgs84_to_ned(item.x / 1e7, item.y / 1e7, around.origin)


def _arrive(
    item: MissionItem, progress: Progress, goal_m: Point | None, around: Surroundings
) -> Progress:
    if progress.arrived_s is not None:
        return progress
    radius_m = around.radius_m
    if item.command == Command.NAV_WAYPOINT and item.params[1] > 0.0:
        radius_m = item.params[1]
    if goal_m is not None and math.dist(goal_m, around.here_m) > radius_m:
        return progress
    if around.air is not None and not _is_at_height(item, around.air, around.origin):
        return progress
    return replace(progress, arrived_s=around.now_s)


def _is_at_height(item: MissionItem, air: Air, origin: Origin) -> bool:
    down_m = down_of(item, air, origin)
    return down_m is None or abs(down_m - air.here_down_m) <= HEIGHT_REACHED_M


def _is_done(item: MissionItem, progress: Progress, around: Surroundings) -> bool:
    if item.command == Command.NAV_LOITER_UNLIM or progress.arrived_s is None:
        return False
    if around.air is not None and item.command in _TO_THE_GROUND:
        return around.air.landed
    waits = item.command in (Command.NAV_WAYPOINT, Command.NAV_DELAY)
    hold_s = max(0.0, item.params[0]) if waits else 0.0
    return around.now_s - progress.arrived_s >= hold_s - 1e-6


def begins_with_take_off(items: Sequence[MissionItem]) -> bool:
    """Whether a take-off comes before whatever else moves the vehicle."""
    moving = (i.command for i in items if i.command not in _WITHOUT_MOTION)
    return next(moving, None) == Command.NAV_TAKEOFF


def state_of(count: int, progress: Progress, running: bool) -> MissionState:
    """MISSION_STATE of a list of `count` items, home among them."""
    if count <= 1:
        return MissionState.NO_MISSION
    if progress.complete:
        return MissionState.COMPLETE
    if running:
        return MissionState.ACTIVE
    return MissionState.PAUSED if progress.started else MissionState.NOT_STARTED


def tidied(item: MissionItem) -> MissionItem:
    """The item with 0 for every param that was left at NaN, as ArduPilot stores it."""
    p1, p2, p3, p4 = (0.0 if math.isnan(p) else p for p in item.params)
    return replace(item, params=(p1, p2, p3, p4), z=0.0 if math.isnan(item.z) else item.z)


def refusal(item: MissionItem, origin: Origin, flies: bool = False) -> MissionResult | None:
    """Why an item can't be taken (it is `tidied`), or None."""
    home = item.mission_type == MissionType.MISSION and item.seq == 0
    known = item.command in _IN_A_LIST.get(MissionType(item.mission_type), ())
    flown = flies and item.mission_type == MissionType.MISSION and item.command in _IN_THE_AIR
    if not (known or flown or home):
        return MissionResult.UNSUPPORTED
    for p, result in zip(
        item.params, (MissionResult.INVALID_PARAM1, MissionResult.INVALID_PARAM2), strict=False
    ):
        if not math.isfinite(p):
            return result
    if not math.isfinite(sum(item.params)):
        return MissionResult.INVALID
    if not math.isfinite(item.z):
        return MissionResult.INVALID_PARAM7
    if flies and abs(item.z) > MAX_DISTANCE_M:
        return MissionResult.INVALID_PARAM7
    if home or item.command in _WITHOUT_PLACE:
        return None
    if item.frame not in tuple(GlobalFrame):
        return MissionResult.UNSUPPORTED_FRAME
    return _place_refusal(item, origin)


def _place_refusal(item: MissionItem, origin: Origin) -> MissionResult | None:
    if (item.x, item.y) == (0, 0) and item.mission_type == MissionType.MISSION:
        return None
    if abs(item.x) > 90 * 10**7:
        return MissionResult.INVALID_PARAM5_X
    if abs(item.y) > 180 * 10**7:
        return MissionResult.INVALID_PARAM6_Y
    north, east = wgs84_to_ned(item.x / 1e7, item.y / 1e7, origin)
    if abs(north) > MAX_DISTANCE_M:
        return MissionResult.INVALID_PARAM5_X
    return MissionResult.INVALID_PARAM6_Y if abs(east) > MAX_DISTANCE_M else None
