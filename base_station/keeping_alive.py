"""Heartbeats and questions for the time: what every vehicle is told, whatever else it is told."""

from collections.abc import Sequence

from base_station.commander import copies
from base_station.commands import AskTime, Command, Heartbeat
from hil.scenario import FleetMember

HEARTBEAT_S = 1.0
TIMESYNC_S = 1.0


class KeepAlive:
    """Once a second of the wall's time or the fleet's, whichever is faster; `firsts`: one vehicle
    on each link. HEARTBEAT, TIMESYNC."""

    def __init__(self, firsts: Sequence[FleetMember]) -> None:
        self._firsts = firsts
        self._beat_s = (float("-inf"), float("-inf"))  # wall, fleet
        self._asked_s = (float("-inf"), float("-inf"))

    def due(self, wall_s: float, fleet_s: float, loss: float) -> list[Command]:
        """What is due now; heartbeats the more often the more gets lost (`loss`: a share of 1), for
        a vehicle that misses a few of them stops by itself."""
        commands: list[Command] = []
        now_s = (wall_s, fleet_s)
        if _since(self._beat_s, now_s) >= HEARTBEAT_S / copies(loss):
            self._beat_s = now_s
            commands += [Heartbeat(m.sysid) for m in self._firsts]
        if _since(self._asked_s, now_s) >= TIMESYNC_S:
            self._asked_s = now_s
            commands += [AskTime(m.sysid, int(wall_s * 1e9)) for m in self._firsts]
        return commands


def _since(before_s: tuple[float, float], now_s: tuple[float, float]) -> float:
    return max(now - before for now, before in zip(now_s, before_s, strict=True))
