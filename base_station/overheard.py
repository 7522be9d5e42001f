"""Telemetry of a fleet that others drove: how the station joins in the middle (pure).

It follows what velocity set-points in GUIDED, and HOLD, made the vehicles do. What moves them in
any other way is not in a log, so there it stops watching, and says why.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from base_station.commander import Commander
from base_station.commands import Command
from base_station.desk import Desk
from base_station.phases import PlanningBeta
from base_station.steps.probing import fresh_watch
from hil import mavlink
from hil.scenario import StationView

ORDERS = (mavlink.LocalSetpoint, mavlink.GlobalSetpoint, mavlink.SetMode, mavlink.CommandLong)
AT_REST_MPS = 0.25  # noise included

Heard = Sequence[tuple[int, mavlink.Received]]  # microseconds, message


def others_drove(view: StationView, heard: Heard) -> bool:
    """Whether no order in the log is from the station of the view."""
    return not any(
        message.sysid == view.station_sysid and isinstance(message.value, ORDERS)
        for _, message in heard
    )


def on_one_clock(view: StationView, heard: Heard) -> Heard:
    """The same with all positions stamped by the first vehicle's clock.

    The earliest arrivals tell how the clocks are apart: delay only ever adds. TIMESYNC goes; it is
    told in clocks of stations that are not known.
    """
    offsets_s: dict[int, float] = {}
    for time_us, message in heard:
        if isinstance(message.value, mavlink.LocalPosition):
            offset_s = time_us / 1e6 - message.value.time_s
            offsets_s[message.sysid] = min(offset_s, offsets_s.get(message.sysid, math.inf))
    reference_s = offsets_s.get(view.fleet[0].sysid, 0.0)
    rewritten = []
    for time_us, message in heard:
        value = message.value
        if isinstance(value, mavlink.Timesync):
            continue
        if isinstance(value, mavlink.LocalPosition):
            time_s = value.time_s + offsets_s[message.sysid] - reference_s
            message = replace(message, value=replace(value, time_s=time_s))
        rewritten.append((time_us, message))
    return rewritten


def join(desk: Desk, commander: Commander) -> list[Command]:
    """Begin to watch as soon as all are located, at rest, and in a mode that can be followed."""
    tracks = desk.fleet.tracks
    ready = all(
        track.samples
        and math.hypot(*track.samples[-1].velocity_mps) < AT_REST_MPS
        and track.status.mode in (autopilot.driven_mode, autopilot.hold_mode)
        and math.isfinite(track.status.yaw_rad)
        for track, autopilot in zip(tracks, commander.autopilots, strict=True)
    )
    if ready:
        commander.released.update(range(len(tracks)))  # nobody takes over what is not commanded
        desk.fleet.start_ticks()
        desk.watch = fresh_watch(desk)
        desk.enter(PlanningBeta(0))
    return []
