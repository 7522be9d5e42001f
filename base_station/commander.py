"""The sending side: what every vehicle should be doing to commands, repeated until it is."""

from dataclasses import dataclass, replace

from base_station.commands import Arm, Command, Drive, SetMode
from base_station.execution import Orders
from base_station.telemetry import Status, Track
from hil.mavlink import RoverMode
from hil.scenario import StationView

REPEAT_S = 0.5
TAKEOVER_S = 2.5  # longer than two heartbeats: a late one must not look like a takeover


@dataclass(frozen=True)
class _Sent:
    """The mode asked for last, when, and since when the vehicle has said something else."""

    mode: RoverMode | None = None
    time_s: float = float("-inf")
    confirmed: bool = False
    strayed_since_s: float | None = None


class Commander:
    """One entry per vehicle, in fleet order. A released vehicle gets nothing but heartbeats."""

    def __init__(self, view: StationView) -> None:
        self._view = view
        self._sent = [_Sent() for _ in view.fleet]
        self._arm_sent_s = [float("-inf")] * len(view.fleet)
        self.released: set[int] = set()

    def arm(self, tracks: list[Track], time_s: float) -> list[Command]:
        """Arming for those that are not armed yet."""
        commands: list[Command] = []
        for i, (member, track) in enumerate(zip(self._view.fleet, tracks, strict=True)):
            if not track.status.armed and time_s - self._arm_sent_s[i] >= REPEAT_S:
                self._arm_sent_s[i] = time_s
                commands.append(Arm(member.sysid))
        return commands

    def mode_asked(self, index: int) -> RoverMode | None:
        return self._sent[index].mode

    def carry_out(self, orders: Orders, tracks: list[Track], time_s: float) -> list[Command]:
        """Mode changes where the mode is not what it should be, and set-points where driven."""
        commands: list[Command] = []
        for i, member in enumerate(self._view.fleet):
            if i in self.released:
                continue
            driven = bool(orders.driven[i])
            commands += self._mode(i, member.sysid, driven, tracks[i].status, time_s)
            if driven:
                north, east, yaw = (float(x) for x in orders.setpoints[i])
                heading = None if yaw != yaw else yaw
                commands.append(Drive(member.sysid, time_s, north, east, heading))
        return commands

    def _mode(
        self, index: int, sysid: int, driven: bool, status: Status, time_s: float
    ) -> list[Command]:
        wanted = RoverMode.GUIDED if driven else RoverMode.HOLD
        sent = self._sent[index]
        changed = sent.mode is not wanted
        if status.mode == wanted and not changed:
            self._sent[index] = replace(sent, confirmed=True, strayed_since_s=None)
            return []
        if sent.confirmed and not changed:
            since = time_s if sent.strayed_since_s is None else sent.strayed_since_s
            self._sent[index] = replace(sent, strayed_since_s=since)
            return []
        if not changed and time_s - sent.time_s < REPEAT_S:
            return []
        self._sent[index] = _Sent(wanted, time_s)
        return [SetMode(sysid, wanted)]

    def takeovers(self, time_s: float) -> list[int]:
        """Vehicles that left a mode they had confirmed, with no command of ours."""
        return [
            i
            for i, sent in enumerate(self._sent)
            if i not in self.released
            and sent.strayed_since_s is not None
            and time_s - sent.strayed_since_s >= TAKEOVER_S
        ]
