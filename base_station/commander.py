"""The sending side: what every vehicle should be doing to commands, repeated until it is."""

import math
from dataclasses import dataclass, replace

from base_station.autopilots import adapter
from base_station.commands import Arm, Command, Drive, SetMode
from base_station.execution import Orders
from base_station.receiving.telemetry import MISSED, Status, Track
from hil.mavlink import stick
from hil.scenario import StationView

ARM_REPEAT_S = 0.5
REPEAT_S = 0.2  # of a mode: until it has been taken, a vehicle does something else
LOSSY = 0.01  # from which loss on copies are sent
STICK_US = 100
LATE, ANSWERED_S = 3.0, 0.2  # until no answer comes any more: standard deviations, and at least
SURE = 0.7  # of the round trip: it varies
SURE_BEATS = 2
TAKEOVER_S = 2.5  # longer than two heartbeats: a late one must not look like a takeover
HEARD_S, UNHEEDED_S = 1.0, 30.0  # of one that is heard, and does not say that it stands


@dataclass(frozen=True)
class _Sent:
    """The mode asked for last, when, and since when the vehicle has said something else."""

    mode: int | None = None
    time_s: float = float("-inf")
    asked_s: float = float("-inf")  # the first time
    before_s: float = float("-inf")  # when another mode was asked for last
    early_beats: int = 0  # of this mode, from when the order before might still come
    confirmed: bool = False
    obeyed: bool = False  # it has been in a mode of ours
    was_armed: bool = False
    sticks_us: tuple[int, ...] = ()  # where a pilot's sticks were at first
    strayed_since_s: float | None = None
    unheeded_since_s: float | None = None  # heard since then, and not known to stand as told


class Commander:
    """One entry per vehicle, in fleet order. A released vehicle gets nothing but heartbeats, until
    it is given back."""

    def __init__(self, view: StationView) -> None:
        self._view, self._rate_hz = view, view.clock.telemetry_hz
        self.autopilots = tuple(adapter(m.autopilot, m.frame) for m in view.fleet)
        self._sent = [_Sent() for _ in view.fleet]
        self._arm_sent_s = [float("-inf")] * len(view.fleet)
        self.released: set[int] = set()

    def arm(self, tracks: list[Track], time_s: float) -> list[Command]:
        """Arming for those that are not armed yet."""
        commands: list[Command] = []
        for i, (member, track) in enumerate(zip(self._view.fleet, tracks, strict=True)):
            if not track.status.armed and time_s - self._arm_sent_s[i] >= ARM_REPEAT_S:
                self._arm_sent_s[i] = time_s
                commands.append(Arm(member.sysid))
        return commands

    def acknowledged(self, index: int, track: Track, time_s: float) -> int | None:
        """A vehicle took a change of mode: to which; None if it can't be the last one asked for.

        An answer does not say what it answers, but none comes faster than the round trip, and few
        much later: copies of the order before are answered, too.
        """
        sent, trip_s = self._sent[index], track.round_trip_s
        soon = time_s - sent.asked_s < SURE * trip_s - 1.0 / self._rate_hz
        return None if soon or _may_come_yet(sent, track, time_s) else sent.mode

    def carry_out(self, orders: Orders, tracks: list[Track], time_s: float) -> list[Command]:
        """Mode changes where the mode is not what it should be, and set-points where driven.

        Set-points of 0 go with an order to stand until it has been taken: it may get lost.
        """
        commands: list[Command] = []
        for i, member in enumerate(self._view.fleet):
            if i in self.released:
                continue
            driven = bool(orders.driven[i])
            if self._is_strayed(i, driven, tracks[i].status, time_s):
                continue
            commands += self._mode(i, member.sysid, driven, tracks[i], time_s)
            self._note_unheeded(i, driven, tracks[i], time_s)
            sent = self._sent[i]
            goes_on = not sent.confirmed and sent.before_s > float("-inf")
            if driven or goes_on or self.autopilots[i].needs_setpoints_first:
                north, east, yaw = (float(x) for x in orders.setpoints[i])
                heading = None if yaw != yaw else yaw
                commands.append(Drive(member.sysid, time_s, north, east, heading))
        return commands

    def _mode(
        self, index: int, sysid: int, driven: bool, track: Track, time_s: float
    ) -> list[Command]:
        autopilot, status = self.autopilots[index], track.status
        wanted = autopilot.driven_mode if driven else autopilot.hold_mode
        sent = self._sent[index]
        changed = sent.mode != wanted
        if status.mode == wanted and not changed:
            early = 0 if sent.early_beats > status.mode_beats else sent.early_beats  # it left, too
            if _may_come_yet(sent, track, time_s):
                self._sent[index] = replace(sent, early_beats=status.mode_beats)
            elif status.mode_beats - early >= SURE_BEATS:
                self._sent[index] = replace(sent, confirmed=True)
            return []
        early = status.mode_beats if status.mode == wanted and sent.mode is not None else 0
        sent = self._sent[index] = replace(sent, early_beats=early)
        repeat_s = max(REPEAT_S, 1.5 * track.round_trip_s)
        if not changed and (sent.confirmed or time_s - sent.time_s < repeat_s):
            return []  # one that was in it and has left is not argued with
        asked_s, before_s = (time_s, sent.time_s) if changed else (sent.asked_s, sent.before_s)
        self._sent[index] = replace(
            sent, mode=wanted, time_s=time_s, asked_s=asked_s, before_s=before_s, confirmed=False
        )
        return [SetMode(sysid, wanted)] * copies(track.loss(time_s, 1.0 / self._rate_hz))

    def _is_strayed(self, index: int, driven: bool, status: Status, time_s: float) -> bool:
        """Whether somebody else has this vehicle: it gets no command while that may be so.

        One heartbeat in the other of our modes may have been late, and a vehicle that has gone by
        itself to the mode that it shall have now, as after a lost link, is not astray.
        """
        autopilot, sent = self.autopilots[index], self._sent[index]
        was_armed = sent.was_armed or status.armed
        sticks_us = sent.sticks_us or status.sticks_us
        ours = (autopilot.driven_mode, autopilot.hold_mode)
        obeyed = sent.obeyed or status.mode in ours
        wanted = autopilot.driven_mode if driven else autopilot.hold_mode
        left = (
            sent.confirmed
            and status.mode not in (sent.mode, wanted)
            and status.mode_beats >= SURE_BEATS
        )
        foreign = obeyed and status.mode not in ours
        strayed = left or foreign or (was_armed and not status.armed)
        strayed = strayed or _moved(sticks_us, status.sticks_us)
        since_s = (
            (time_s if sent.strayed_since_s is None else sent.strayed_since_s) if strayed else None
        )
        self._sent[index] = replace(
            sent, was_armed=was_armed, sticks_us=sticks_us, obeyed=obeyed, strayed_since_s=since_s
        )
        return strayed

    def _note_unheeded(self, index: int, driven: bool, track: Track, time_s: float) -> None:
        sent = self._sent[index]
        heard = time_s - track.newest_s() < HEARD_S
        waits = heard and not driven and not sent.confirmed and track.status.mode != sent.mode
        since_s = time_s if sent.unheeded_since_s is None else sent.unheeded_since_s
        self._sent[index] = replace(sent, unheeded_since_s=since_s if waits else None)

    def unheeding(self, time_s: float) -> list[int]:
        """Vehicles that are heard, were told to stand, and for long have not said that they do."""
        return [
            i
            for i, sent in enumerate(self._sent)
            if i not in self.released
            and sent.unheeded_since_s is not None
            and time_s - sent.unheeded_since_s >= UNHEEDED_S
        ]

    def all_holding(self, tracks: list[Track]) -> bool:
        """Everybody armed, and in the mode in which it stands."""
        return all(
            t.status.armed and t.status.mode == autopilot.hold_mode
            for t, autopilot in zip(tracks, self.autopilots, strict=True)
        )

    def give_back(self) -> tuple[int, ...]:
        """Vehicles that were let go of are ours again; what was done with them is forgotten."""
        back = tuple(sorted(self.released))
        for i in back:
            self._sent[i] = _Sent()
        self.released.clear()
        return back

    def takeovers(self, time_s: float) -> list[int]:
        """Vehicles in a mode, disarmed, or under sticks, with no command of ours."""
        return [
            i
            for i, sent in enumerate(self._sent)
            if i not in self.released
            and sent.strayed_since_s is not None
            and time_s - sent.strayed_since_s >= TAKEOVER_S
        ]


def _may_come_yet(sent: _Sent, track: Track, time_s: float) -> bool:
    """Whether the order before the last, or an answer to it, may still be under way."""
    late_s = track.round_trip_s + LATE * track.jitter_s + ANSWERED_S
    return time_s - sent.before_s < late_s


def copies(loss: float) -> int:
    """How often to send what must arrive: until it moves on, a vehicle does what it did before."""
    return 1 if loss < LOSSY else 1 + round(math.log(MISSED) / math.log(min(loss, 0.5)))


def _moved(before_us: tuple[int, ...], now_us: tuple[int, ...]) -> bool:
    """Whether a pilot's stick is not where it was; channels that are not there do not count."""
    pairs = zip(before_us, now_us, strict=False)
    return any(
        stick(a) is not None and stick(b) is not None and abs(a - b) > STICK_US for a, b in pairs
    )
