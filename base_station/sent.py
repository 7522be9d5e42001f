"""The orders that a log says were sent, at any time of the fleet's clock (pure)."""

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from base_station import execution
from base_station.autopilots import Autopilot, adapter
from base_station.execution import Orders
from base_station.receiving.fleet import Fleet
from hil import mavlink
from hil.frames import body_to_ned
from hil.scenario import StationView

TRUSTED_S = 1.0  # a set-point stamped further than this from the fleet's time has no stamp
EARLY_S = 1e-3
SETTLED_S = 2.0  # after a command, a heartbeat may still tell the mode before it
BODY_FRAMES = (mavlink.Frame.BODY_NED, mavlink.Frame.BODY_OFFSET_NED)

T = TypeVar("T")
Setpoint = tuple[float, float, float]  # north, east (m/s), yaw (rad, NaN: not commanded)


@dataclass(frozen=True)
class SentOrders:
    """Per vehicle, in fleet order: modes, arming and set-points by the fleet time of each.

    A set-point of None is one that the twin can't follow: a position.
    """

    autopilots: tuple[Autopilot, ...]
    modes: tuple[tuple[tuple[float, int], ...], ...]
    armed: tuple[tuple[tuple[float, bool], ...], ...]
    setpoints: tuple[tuple[tuple[float, Setpoint | None], ...], ...]

    def at(self, time_s: float) -> Orders:
        """What every vehicle was to do after the tick of `time_s`."""
        orders = execution.hold(len(self.modes))
        for k in range(len(self.modes)):
            setpoint = self._heeded(k, time_s)
            if setpoint is not None and setpoint[1] is not None:
                orders.setpoints[k] = setpoint[1]
                orders.driven[k] = True
        return orders

    def unknown(self, time_s: float) -> tuple[int, str] | None:
        """A vehicle (index) of which nobody knows what it was to do, and why."""
        for k in range(len(self.modes)):
            mode, setpoint = _latest(self.modes[k], time_s), self._heeded(k, time_s)
            followed = self.autopilots[k].driven_mode, self.autopilots[k].hold_mode
            if mode is not None and mode[1] not in followed:
                return k, f"is in mode {mode[1]}"
            if setpoint is not None and setpoint[1] is None:
                return k, "was sent to a position"
        return None

    def _heeded(self, k: int, time_s: float) -> tuple[float, Setpoint | None] | None:
        """The set-point that vehicle `k` follows."""
        mode, armed = _latest(self.modes[k], time_s), _latest(self.armed[k], time_s)
        setpoint = _latest(self.setpoints[k], time_s)
        timeout_s = self.autopilots[k].setpoint_timeout_s
        if mode is None or mode[1] != self.autopilots[k].driven_mode or setpoint is None:
            return None
        if (armed is not None and not armed[1]) or time_s - setpoint[0] > timeout_s:
            return None
        return setpoint


def sent_orders(view: StationView, heard: Iterable[tuple[int, mavlink.Received]]) -> SentOrders:
    """Gather modes and set-points from messages of both directions, whoever sent them."""
    gathering = _Gathering(view)
    for time_us, message in heard:
        gathering.take(time_us / 1e6, message)
    return gathering.sent()


class _Gathering:
    def __init__(self, view: StationView) -> None:
        self._station_sysid = view.station_sysid
        self._index = {m.sysid: k for k, m in enumerate(view.fleet)}
        self._fleet = Fleet(view)
        self._autopilots = tuple(adapter(m.autopilot, m.frame) for m in view.fleet)
        self._modes: list[list[tuple[float, int]]] = [[] for _ in view.fleet]
        self._armed: list[list[tuple[float, bool]]] = [[] for _ in view.fleet]
        self._setpoints: list[list[tuple[float, Setpoint | None]]] = [[] for _ in view.fleet]

    def take(self, log_s: float, message: mavlink.Received) -> None:
        if message.sysid in self._index:
            k = self._index[message.sysid]
            self._fleet.receive(k, message, log_s)
            if isinstance(message.value, mavlink.Heartbeat):
                self._note(k, message.value)
            return
        k = self._index.get(getattr(message.value, "target_sysid", 0), -1)
        if k >= 0:
            self._command(k, message.value, trusted=message.sysid == self._station_sysid)

    def sent(self) -> SentOrders:
        return SentOrders(
            self._autopilots,
            tuple(tuple(sorted(one, key=_time)) for one in self._modes),
            tuple(tuple(sorted(one, key=_time)) for one in self._armed),
            tuple(tuple(sorted(one, key=_time)) for one in self._setpoints),
        )

    @property
    def _newest_s(self) -> float:
        return self._fleet.newest_s if math.isfinite(self._fleet.newest_s) else 0.0

    @property
    def _tick_s(self) -> float:
        return math.floor(self._newest_s / self._fleet.period_s + EARLY_S) * self._fleet.period_s

    def _note(self, k: int, heartbeat: mavlink.Heartbeat) -> None:
        """What a vehicle says of itself, unless it has not yet taken in what it was told."""
        _append(self._modes[k], self._tick_s, heartbeat.custom_mode)
        _append(self._armed[k], self._tick_s, heartbeat.armed)

    def _command(self, k: int, value: object, trusted: bool) -> None:
        autopilot = self._autopilots[k]
        match value:
            case mavlink.CommandLong(command=mavlink.Command.DO_SET_MODE):
                drives = autopilot.drives(value)  # if not, heartbeats say which other mode it is
                mode = autopilot.driven_mode if drives else autopilot.hold_mode
                self._modes[k].append((self._tick_s, mode))
            case mavlink.SetMode(custom_mode=mode):
                self._modes[k].append((self._tick_s, mode))
            case (
                mavlink.CommandLong(command=mavlink.Command.COMPONENT_ARM_DISARM, params=params)
                | mavlink.CommandInt(command=mavlink.Command.COMPONENT_ARM_DISARM, params=params)
            ):
                self._armed[k].append((self._tick_s, params[0] > 0.5))
            case mavlink.LocalSetpoint() | mavlink.GlobalSetpoint():
                stamped = trusted and abs(value.time_s - self._newest_s) < TRUSTED_S
                at_s = value.time_s if stamped else self._tick_s
                self._setpoints[k].append((at_s, self._setpoint(k, value)))
            case _:
                pass

    def _setpoint(
        self, k: int, value: mavlink.LocalSetpoint | mavlink.GlobalSetpoint
    ) -> Setpoint | None:
        if value.velocity_mps is None:
            return None
        north, east, _ = value.velocity_mps
        yaw = math.nan if value.yaw_rad is None else value.yaw_rad
        if isinstance(value, mavlink.LocalSetpoint) and value.frame in BODY_FRAMES:
            heading = self._fleet.tracks[k].status.yaw_rad
            north, east = body_to_ned(north, east, heading)
            yaw += heading
        return (north, east, yaw)


def _append(entries: list[tuple[float, T]], time_s: float, value: T) -> None:
    """Add what is new; what was so before the last command may be stale."""
    if entries and entries[-1][1] == value:
        return
    stale = len(entries) > 1 and entries[-2][1] == value and time_s - entries[-1][0] < SETTLED_S
    if not stale:
        entries.append((time_s, value))


def _time(entry: tuple[float, Any]) -> float:
    return entry[0]


def _latest(entries: Sequence[tuple[float, T]], time_s: float) -> tuple[float, T] | None:
    count = bisect_right(entries, time_s + EARLY_S, key=_time)
    return entries[count - 1] if count else None
