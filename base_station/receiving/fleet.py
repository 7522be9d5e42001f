"""The receiving side: messages of all vehicles to tracks, on one clock, cut into ticks."""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from base_station.autopilots import adapter
from base_station.fitted import latency_s
from base_station.receiving.fleet_clock import FleetClock
from base_station.receiving.local_origin import LocalOrigin
from base_station.receiving.telemetry import (
    Fix,
    Frame,
    Receivers,
    Sample,
    Track,
    frame_at,
    note,
)
from hil import mavlink
from hil.frames import wgs84_to_ned
from hil.scenario import StationView

WAIT_FOR_LATE_S = 0.3  # fleet time; then a tick goes on without the vehicle that is late
LINK_LOST_WALL_S = 5.0
LINK_GIVEN_UP_WALL_S = 60.0
ANSWER_WITHIN_S = 30.0  # a TIMESYNC answer to what was asked later than now, or long ago, is none
JUST_HEARD_WALL_S = 0.5
KEPT_REPORTS = 1024  # how far back it is known what had been heard
FIX_LAG_S = 0.1  # a receiver tells where it was so long ago: what u-blox take at 5 Hz
STALE_FIX_S = 5.0  # older than the newest report: its time is not that of the vehicle
LONG_GAP_S = 6.0  # after that long without a command nothing moves: no need to tick through it


class Fleet:
    """Tracks in fleet order. Only messages from the vehicle that belongs on a link count."""

    def __init__(self, view: StationView) -> None:
        self.view = view
        self.tracks = [Track() for _ in view.fleet]
        self._clock = FleetClock(tuple(m.sysid for m in view.fleet))
        self._autopilots = [adapter(m.autopilot, m.frame) for m in view.fleet]
        self._origins = [
            LocalOrigin(view.origin.origin()) if a.has_own_origin else None
            for a in self._autopilots
        ]
        self._newest: deque[tuple[float, float]] = deque(maxlen=KEPT_REPORTS)  # wall, fleet time
        self._next_tick = 0  # in ticks of 1 / telemetry_hz of fleet time

    @property
    def period_s(self) -> float:
        return 1.0 / self.view.clock.telemetry_hz

    def worst_loss(self, time_s: float) -> float:
        """The share of reports that the worst link loses."""
        return max(track.loss(time_s, self.period_s) for track in self.tracks)

    def receive(self, index: int, message: mavlink.Received, wall_s: float) -> None:
        """Take in one message that arrived on vehicle `index`'s link."""
        member, track = self.view.fleet[index], self.tracks[index]
        if message.sysid != member.sysid or message.compid != mavlink.COMPONENT_AUTOPILOT:
            return
        track.last_heard_wall_s = wall_s
        value = message.value
        track.said(note(track.status, value, len(member.frame.motors)))
        origin = self._origins[index]
        if origin is not None:
            origin.hear(value)
        offset_m = (0.0, 0.0) if origin is None else origin.offset_m
        if isinstance(value, mavlink.LocalPosition) and offset_m is not None:
            time_s = self._clock.fleet_time_s(member.sysid, value.time_s)
            north, east = (value.position_m[k] + offset_m[k] for k in (0, 1))
            v_north, v_east, _ = value.velocity_mps
            track.position(Sample(time_s, (north, east), (v_north, v_east)))
            self._newest.append((wall_s, self.newest_s))
        elif isinstance(value, mavlink.GpsRaw) and track.samples:
            if value.fix_type >= mavlink.FixType.FIX_3D:
                place_m = wgs84_to_ned(value.lat_deg, value.lon_deg, self.view.origin.origin())
                track.fix(Fix(self._fix_time_s(index, value.time_s), place_m))
        elif isinstance(value, mavlink.Timesync) and value.tc1_ns:
            now_ns = int(wall_s * 1e9)
            if 0 <= now_ns - value.ts1_ns <= ANSWER_WITHIN_S * 1e9:
                self._clock.reply(member.sysid, value.tc1_ns, value.ts1_ns, now_ns)
                arrived_s = self._clock.fleet_time_s(member.sysid, 1e-9 * value.tc1_ns)
                track.answered(arrived_s - self._newest_at(1e-9 * value.ts1_ns))

    def fleet_time_s(self, index: int, boot_s: float) -> float:
        """A vehicle's own time as fleet time."""
        return self._clock.fleet_time_s(self.view.fleet[index].sysid, boot_s)

    def mode_acknowledged(self, index: int, mode: int) -> None:
        """The vehicle said that it is in `mode` now, before its next heartbeat does."""
        track = self.tracks[index]
        track.said(replace(track.status, mode=mode, mode_beats=0))

    @property
    def newest_s(self) -> float:
        return max(t.newest_s() for t in self.tracks)

    @property
    def complete(self) -> bool:
        """All vehicles heard, located, and ready to arm."""
        return all(
            t.status.heard and t.samples and autopilot.ready(t.status)
            for t, autopilot in zip(self.tracks, self._autopilots, strict=True)
        )

    def start_ticks(self) -> None:
        """Begin with the first whole tick from now on."""
        self._next_tick = int(self.newest_s / self.period_s) + 1

    def due(self) -> list[Frame]:
        """The frames whose time has come: all vehicles in, or the late ones waited for.

        Of a gap longer than LONG_GAP_S only the beginning and the end.
        """
        frames: list[Frame] = []
        while self._is_due(self._next_tick * self.period_s):
            time_s = self._next_tick * self.period_s
            pairs = zip(self.tracks, self._autopilots, strict=True)
            driven = [t.mode_at(time_s - self.period_s) == a.driven_mode for t, a in pairs]
            frame = frame_at(self.tracks, time_s, self.period_s, self.newest_s, driven)
            own_s = np.array([latency_s(m) for m in self.view.fleet])
            frame = replace(frame, delay_s=frame.delay_s + own_s)
            frames.append(self._with_receivers(frame))
            self._next_tick += 1
            if len(frames) == round(LONG_GAP_S / self.period_s):
                newest = int((self.newest_s + 1e-3) / self.period_s)
                self._next_tick = max(self._next_tick, newest)
        return frames

    def _fix_time_s(self, index: int, told_s: float) -> float:
        """When a vehicle was where its newest fix is; some receivers tell the time of day."""
        newest_s, time_s = self.tracks[index].newest_s(), self.fleet_time_s(index, told_s)
        return (time_s if abs(newest_s - time_s) <= STALE_FIX_S else newest_s) - FIX_LAG_S

    def _with_receivers(self, frame: Frame) -> Frame:
        """What receivers and estimators say of themselves, where the view counts that.

        An estimate without an accelerometer in it is nothing but filtered fixes.
        """
        if self.view.diagnosis.evidence == "position":
            return frame
        pairs = list(zip(self.tracks, self._autopilots, strict=True))
        fixes = [None if a.estimate_lags else t.fix_at(frame.time_s) for t, a in pairs]
        receivers = Receivers(
            fix_m=np.array([f.position_m if f else (math.nan, math.nan) for f in fixes]),
            fix_s=np.array([f.time_s if f else math.nan for f in fixes]),
            lost=np.array([a.lost(t.status) for t, a in pairs]),
        )
        return replace(frame, receivers=receivers)

    def excuse(self, absent_s: float) -> None:
        """Silence of vehicles does not count while the station itself was not listening."""
        for track in self.tracks:
            track.last_heard_wall_s += absent_s

    def _newest_at(self, wall_s: float) -> float:
        """Fleet time of the newest report, just heard at `wall_s`; NaN: there is none."""
        for heard_s, newest_s in reversed(self._newest):
            if heard_s <= wall_s + 1e-6:
                return newest_s if wall_s - heard_s < JUST_HEARD_WALL_S else math.nan
        return math.nan

    def _is_due(self, time_s: float) -> bool:
        times = [t.newest_s() for t in self.tracks]
        return min(times) >= time_s - 1e-3 or max(times) >= time_s + WAIT_FOR_LATE_S

    def silent(self, wall_s: float, for_s: float = LINK_LOST_WALL_S) -> list[int]:
        """Vehicles not heard of for so long, once they had been."""
        return [
            i
            for i, t in enumerate(self.tracks)
            if t.status.heard and wall_s - t.last_heard_wall_s > for_s
        ]
