"""The last word on what is sent to vehicles that may be real (pure).

Between the station and its links: speeds are cut, a vehicle at the fence or, where contact is not
allowed, close to another is held, and so is everybody after an emergency stop.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from base_station.autopilots import Autopilot
from base_station.commands import Arm, Command, Drive, SetMode
from base_station.receiving.telemetry import Track
from hil.scenario import Point, Safety, StationView

LOOK_AHEAD_S = 1.0  # what a rover at speed needs to stand


@dataclass(frozen=True)
class Held:
    """A vehicle that was not let go where it was told to, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class Permitted:
    commands: tuple[Command, ...]
    held: tuple[Held, ...]


def permitted(
    view: StationView,
    autopilots: Sequence[Autopilot],
    tracks: Sequence[Track],
    commands: Sequence[Command],
) -> Permitted:
    """The same commands as far as they are safe. Without `view.safety` all of them are."""
    if view.safety is None:
        return Permitted(tuple(commands), ())
    index = {m.sysid: i for i, m in enumerate(view.fleet)}
    out: list[Command] = []
    held: list[Held] = []
    for command in commands:
        if not isinstance(command, Drive):
            out.append(command)
            continue
        i = index[command.sysid]
        drive = slower(command, view.limits.speed_mps)
        reason = why_not(view, view.safety, i, tracks, drive)
        near = _nearest_ahead(view, i, tracks, drive)
        if reason is None and near is not None:
            drive = slower(drive, touch_speed_mps(view, view.safety, i))
        if reason is None:
            out.append(drive)
        else:
            held.append(Held(view.fleet[i].name, reason))
            out.append(SetMode(command.sysid, autopilots[i].hold_mode))
    return Permitted(tuple(out), tuple(held))


def stop_all(view: StationView, autopilots: Sequence[Autopilot]) -> tuple[Command, ...]:
    """Everybody stands: dead-man and end of the station."""
    return tuple(SetMode(m.sysid, a.hold_mode) for m, a in zip(view.fleet, autopilots, strict=True))


def disarm_all(view: StationView) -> tuple[Command, ...]:
    """Emergency stop: motors off, whatever the vehicles are doing."""
    return tuple(Arm(m.sysid, armed=False) for m in view.fleet)


def slower(drive: Drive, limit_mps: float) -> Drive:
    """The same direction, no faster than the limit."""
    speed = math.hypot(drive.north_mps, drive.east_mps)
    if speed <= limit_mps:
        return drive
    share = limit_mps / speed
    return replace(drive, north_mps=drive.north_mps * share, east_mps=drive.east_mps * share)


def touch_speed_mps(view: StationView, safety: Safety, i: int) -> float:
    """How fast a vehicle may meet another: by speed, and by impulse over its mass."""
    return min(safety.contact_speed_mps, safety.contact_impulse_ns / view.fleet[i].frame.mass_kg)


def why_not(
    view: StationView, safety: Safety, i: int, tracks: Sequence[Track], drive: Drive
) -> str | None:
    """What speaks against driving so, in words."""
    here = _place(tracks[i])
    if here is None:
        return "its position is not known"
    there = _ahead(here, drive)
    margin_m = view.fleet[i].frame.radius_m + safety.fence_margin_m
    if not view.arena.contains(there, margin_m) and not _goes_in(view, here, there):
        return "the fence is ahead"
    if not safety.allow_contact and _nearest_ahead(view, i, tracks, drive) is not None:
        return f"{_nearest_ahead(view, i, tracks, drive)} is ahead, and contact is not allowed"
    return None


def _goes_in(view: StationView, here: Point, there: Point) -> bool:
    """Whether a vehicle that is out comes closer to the middle of the arena."""
    a = view.arena
    middle = ((a.north_min_m + a.north_max_m) / 2.0, (a.east_min_m + a.east_max_m) / 2.0)
    far, near = (math.dist((p.north_m, p.east_m), middle) for p in (here, there))
    return near < far


def _nearest_ahead(view: StationView, i: int, tracks: Sequence[Track], drive: Drive) -> str | None:
    """The name of a vehicle that this one comes within reach of, approaching it."""
    here = _place(tracks[i])
    if here is None:
        return None
    there = _ahead(here, drive)
    for j, (member, track) in enumerate(zip(view.fleet, tracks, strict=True)):
        other = _place(track)
        if j == i or other is None:
            continue
        reach_m = view.fleet[i].frame.radius_m + member.frame.radius_m
        before = math.dist((here.north_m, here.east_m), (other.north_m, other.east_m))
        after = math.dist((there.north_m, there.east_m), (other.north_m, other.east_m))
        if after < before and after < reach_m:
            return member.name
    return None


def _place(track: Track) -> Point | None:
    if not track.samples:
        return None
    north, east = track.samples[-1].position_m
    return Point(north_m=north, east_m=east)


def _ahead(here: Point, drive: Drive) -> Point:
    return Point(
        north_m=here.north_m + LOOK_AHEAD_S * drive.north_mps,
        east_m=here.east_m + LOOK_AHEAD_S * drive.east_mps,
    )
