"""The lists that a station has uploaded, and what AUTO, RTL and the fence make of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hil.frames import Origin, wgs84_to_ned
from hil.mavlink import (
    Command,
    GlobalFrame,
    Message,
    MissionCurrent,
    MissionItem,
    MissionItemReached,
    MissionResult,
    MissionType,
    RoverMode,
    Severity,
    StatusText,
)
from sim_vehicles.autopilot import Target
from sim_vehicles.fence import Circle, Zone, breached, zones_of
from sim_vehicles.mission import (
    Advance,
    Air,
    Point,
    Progress,
    Surroundings,
    advance,
    begins_with_take_off,
    state_of,
)

Items = tuple[MissionItem, ...]
CIRCLE_BIT, ZONES_BIT = 2, 4  # FENCE_TYPE


@dataclass(frozen=True, slots=True)
class Return:
    """The way home of what flies."""

    items: Items
    progress: Progress

    @classmethod
    def begun(cls, height_m: float, air: Air) -> "Return":
        """On the ground there is nothing to do."""
        rise = max(height_m, air.home_down_m - air.here_down_m)
        commands = () if air.landed else (Command.NAV_TAKEOFF, Command.NAV_RETURN_TO_LAUNCH)
        rows = enumerate((Command.NAV_WAYPOINT, *commands))
        frame, none = GlobalFrame.GLOBAL_RELATIVE_ALT, (0.0,) * 4
        items = tuple(MissionItem(0, 0, i, frame, c, none, 0, 0, rise) for i, c in rows)
        return cls(items, Progress())


def _target(step: Advance, now_s: float) -> Target:
    height = Target(
        now_s,
        speed_mps=step.progress.speed_mps,
        down_m=step.down_m,
        lifts=step.lifts,
        lands=step.lands,
    )
    if step.goal_m is None:
        return replace(height, velocity_mps=(0.0, 0.0))
    return replace(height, position_m=step.goal_m)


class Navigator:
    """Mission, fence and rally points of one vehicle."""

    def __init__(self, origin: Origin, flies: bool = False) -> None:
        self._origin, self.flies = origin, flies
        self._zones: tuple[Zone, ...] = ()
        self._running = False
        self._return: Return | None = None
        self.progress = Progress()
        self.lists: dict[MissionType, Items] = dict.fromkeys(
            (MissionType.MISSION, MissionType.FENCE, MissionType.RALLY), ()
        )

    @property
    def has_mission(self) -> bool:
        """Whether there is anything after home."""
        return len(self.lists[MissionType.MISSION]) > 1

    @property
    def has_zones(self) -> bool:
        return bool(self._zones)

    @property
    def takes_off(self) -> bool:
        """Whether the next item that needs the air is a take-off."""
        seq = 1 if self.progress.complete else self.progress.seq
        return begins_with_take_off(self.lists[MissionType.MISSION][seq:])

    def rewind(self) -> None:
        """A mission that was left before its end starts again, as in ArduPilot after disarming."""
        if not self.progress.complete:
            self.progress = Progress()

    def store(self, kind: MissionType, items: Sequence[MissionItem]) -> MissionResult:
        """Take a whole list over; a mission starts again from its first item."""
        if kind is MissionType.FENCE:
            zones = zones_of(items, self._origin)
            if zones is None:
                return MissionResult.INVALID
            self._zones = zones
        if kind is MissionType.MISSION:
            self.progress = Progress()
        self.lists[kind] = tuple(items)
        return MissionResult.ACCEPTED

    def set_current(self, seq: int) -> bool:
        """Go on with an item. False when there is none of that number; 0 starts again."""
        if not 0 <= seq < len(self.lists[MissionType.MISSION]):
            return False
        self.progress = Progress(max(1, seq), speed_mps=self.progress.speed_mps)
        return True

    def current(self) -> MissionCurrent:
        count = len(self.lists[MissionType.MISSION])
        seq = min(self.progress.seq, max(0, count - 1))
        state = state_of(count, self.progress, self._running)
        return MissionCurrent(seq, max(0, count - 1), state)

    def steer(self, mode: RoverMode, around: Surroundings) -> tuple[Target | None, list[Message]]:
        """Where AUTO or RTL wants to go now, and what to tell; other modes pause the mission."""
        resumed = mode is RoverMode.AUTO and not self._running
        self._running = mode is RoverMode.AUTO
        if mode is not RoverMode.RTL:
            self._return = None
        elif around.air is not None:
            return self._fly_home(around, around.air), []
        else:
            return Target(around.now_s, position_m=self._way_home(around)), []
        if mode is not RoverMode.AUTO:
            return None, []
        if resumed and self.progress.complete:
            self.progress = Progress()
        return self._run(around)

    def _fly_home(self, around: Surroundings, air: Air) -> Target:
        """Rise to RTL_ALT, go home, land: a mission of its own."""
        around = replace(around, home_m=self._way_home(around))
        if self._return is None:
            self._return = Return.begun(around.return_height_m, air)
        step = advance(self._return.items, self._return.progress, around)
        self._return = replace(self._return, progress=step.progress)
        return _target(step, around.now_s)

    def _run(self, around: Surroundings) -> tuple[Target, list[Message]]:
        before = self.progress
        step = advance(self.lists[MissionType.MISSION], before, around)
        self.progress = step.progress
        told: list[Message] = []
        for seq in step.reached:
            told += [
                StatusText(Severity.INFO, f"Reached waypoint #{seq}"),
                MissionItemReached(seq),
            ]
        if self.progress.seq != before.seq:
            told.append(self.current())
        if self.progress.complete and not before.complete:
            told.append(StatusText(Severity.NOTICE, "Mission Complete"))
        return _target(step, around.now_s), told

    def _way_home(self, around: Surroundings) -> Point:
        """The nearest of home and the rally points."""
        rally = [
            wgs84_to_ned(item.x / 1e7, item.y / 1e7, self._origin)
            for item in self.lists[MissionType.RALLY]
        ]
        return min((around.home_m, *rally), key=lambda point: math.dist(point, around.here_m))

    def is_outside(self, here_m: Point, home_m: Point, fence_type: int, radius_m: float) -> bool:
        """Whether a point breaches the fences that FENCE_TYPE chooses."""
        zones = self._zones if fence_type & ZONES_BIT else ()
        circle = (Circle(home_m, radius_m, True),) if fence_type & CIRCLE_BIT else ()
        return breached((*zones, *circle), here_m)
