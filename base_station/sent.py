"""The orders that a log says were sent, at any time of the fleet's clock (pure)."""

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

from base_station import execution
from base_station.autopilots import adapter
from base_station.execution import Orders
from base_station.fleet import Fleet
from hil import mavlink
from hil.scenario import StationView

TIMEOUT_S = 3.0  # an autopilot forgets a set-point that is older
TRUSTED_S = 1.0  # a set-point stamped further than this from the fleet's time has no stamp
EARLY_S = 1e-3

T = TypeVar("T")
Setpoint = tuple[float, float, float]  # north, east (m/s), yaw (rad, NaN: not commanded)


@dataclass(frozen=True)
class SentOrders:
    """Per vehicle, in fleet order: driven or not, and set-points, by the fleet time of sending."""

    modes: tuple[tuple[tuple[float, bool], ...], ...]
    setpoints: tuple[tuple[tuple[float, Setpoint], ...], ...]

    def at(self, time_s: float) -> Orders:
        """What every vehicle was to do after the tick of `time_s`."""
        orders = execution.hold(len(self.modes))
        for k in range(len(self.modes)):
            mode, setpoint = _latest(self.modes[k], time_s), _latest(self.setpoints[k], time_s)
            if mode is None or setpoint is None or not mode[1]:
                continue
            if time_s - setpoint[0] <= TIMEOUT_S:
                orders.setpoints[k] = setpoint[1]
                orders.driven[k] = True
        return orders


def sent_orders(view: StationView, heard: Iterable[tuple[int, mavlink.Received]]) -> SentOrders:
    """Gather DO_SET_MODE and SET_POSITION_TARGET_LOCAL_NED from messages of both directions."""
    index = {m.sysid: k for k, m in enumerate(view.fleet)}
    fleet = Fleet(view)
    autopilots = [adapter(m.autopilot, m.frame) for m in view.fleet]
    modes: list[list[tuple[float, bool]]] = [[] for _ in view.fleet]
    setpoints: list[list[tuple[float, Setpoint]]] = [[] for _ in view.fleet]
    for time_us, message in heard:
        if message.sysid in index:
            fleet.receive(index[message.sysid], message, time_us / 1e6)
            continue
        newest_s = fleet.newest_s if math.isfinite(fleet.newest_s) else 0.0
        tick_s = math.floor(newest_s / fleet.period_s + EARLY_S) * fleet.period_s
        match message.value:
            case mavlink.CommandLong(command=mavlink.Command.DO_SET_MODE) as command:
                k = index.get(command.target_sysid)
                if k is not None:
                    modes[k].append((tick_s, autopilots[k].drives(command)))
            case mavlink.LocalSetpoint(velocity_mps=(north, east, _)) as command:
                stamped = abs(command.time_s - newest_s) < TRUSTED_S
                yaw = math.nan if command.yaw_rad is None else command.yaw_rad
                if command.target_sysid in index:
                    at_s = command.time_s if stamped else tick_s
                    setpoints[index[command.target_sysid]].append((at_s, (north, east, yaw)))
            case _:
                pass
    return SentOrders(
        tuple(tuple(sorted(one, key=_time)) for one in modes),
        tuple(tuple(sorted(one, key=_time)) for one in setpoints),
    )


def _time(entry: tuple[float, Any]) -> float:
    return entry[0]


def _latest(entries: Sequence[tuple[float, T]], time_s: float) -> tuple[float, T] | None:
    count = bisect_right(entries, time_s + EARLY_S, key=_time)
    return entries[count - 1] if count else None
