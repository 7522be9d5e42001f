"""Before a vehicle is driven: rates asked for and checked, settings set and read back, its origin.

Pure: what is heard goes in, commands and words come out. `wall_s` is any monotonic clock.
"""

from collections import deque
from collections.abc import Mapping

from base_station.autopilots import Autopilot, Rate, Setting
from base_station.commands import AskRate, Command, RequestMessage, SetParameter
from hil import mavlink
from hil.scenario import FleetMember

REPEAT_S = 1.0
RATE_WINDOW = 20  # messages
RATE_SLACK = 0.7  # of the rate asked for: below, it is not honoured
SETTLED_S = 5.0  # of vehicle time after the first word, until rates are judged


class Preparation:
    """What one vehicle has been asked for, and what it has done of that."""

    def __init__(
        self,
        member: FleetMember,
        autopilot: Autopilot,
        telemetry_hz: float,
        station_sysid: int,
        wants: tuple[Rate, ...] = (),
    ) -> None:
        self._member, self._autopilot = member, autopilot
        wanted = {r.message: r for r in (*autopilot.rates(telemetry_hz), *wants)}
        self._rates = tuple(wanted.values())
        self._settings = dict.fromkeys(autopilot.settings(station_sysid))
        self._read: dict[Setting, float | None] = dict(self._settings)
        self._located = not autopilot.has_own_origin
        self._arrivals: dict[int, deque[float]] = {
            int(r.message): deque(maxlen=RATE_WINDOW) for r in self._rates
        }
        self._first_s: float | None = None
        self._now_s = float("-inf")  # vehicle time
        self._asked_s = float("-inf")
        self.warned = False

    def hear(self, value: object) -> None:
        """One message of this vehicle."""
        match value:
            case mavlink.LocalPosition(time_s=time_s):
                self._now_s = max(self._now_s, time_s)
                self._first_s = self._now_s if self._first_s is None else self._first_s
            case mavlink.GpsOrigin() | mavlink.HomePosition():
                self._located = True
            case mavlink.ParamValue():
                for setting in self._read:
                    if value.name in setting.names:
                        self._read[setting] = self._autopilot.parameter(value)
            case _:
                pass
        if isinstance(value, mavlink.Message) and int(value.ID) in self._arrivals:
            self._arrivals[int(value.ID)].append(self._now_s)

    def asks(self, wall_s: float) -> list[Command]:
        """What is still to be asked, each second of wall time."""
        if wall_s - self._asked_s < REPEAT_S:
            return []
        self._asked_s = wall_s
        sysid = self._member.sysid
        commands: list[Command] = [AskRate(sysid, r.message, r.hz) for r in self._slow()]
        if not self._located:
            wanted = (mavlink.MessageId.GPS_GLOBAL_ORIGIN, mavlink.MessageId.HOME_POSITION)
            commands += [RequestMessage(sysid, message) for message in wanted]
        for setting in self._unset():
            commands += [SetParameter(sysid, name, setting.value) for name in setting.names]
        return commands

    @property
    def done(self) -> bool:
        """Settings read back as wanted, origin known, and rates honoured or complained of."""
        return not self._unset() and self._located and (not self._slow() or self._settled)

    def warnings(self) -> tuple[str, ...]:
        """Rates that are not honoured, in words, once."""
        if self.warned or not self._settled:
            return ()
        self.warned = True
        rates = self.measured_hz()
        return tuple(
            f"{self._member.name} sends {r.message.name} at {rates[int(r.message)]:.1f} Hz "
            f"instead of {r.hz:g}"
            for r in self._slow()
        )

    def measured_hz(self) -> Mapping[int, float]:
        """By message id, over the last twenty; 0 for what has not come twice."""
        return {number: _rate_hz(times) for number, times in self._arrivals.items()}

    @property
    def _settled(self) -> bool:
        return self._first_s is not None and self._now_s - self._first_s >= SETTLED_S

    def _slow(self) -> list[Rate]:
        rates = self.measured_hz()
        return [r for r in self._rates if rates[int(r.message)] < RATE_SLACK * r.hz]

    def _unset(self) -> list[Setting]:
        return [s for s, value in self._read.items() if value != s.value]


def _rate_hz(times_s: deque[float]) -> float:
    span_s = times_s[-1] - times_s[0] if len(times_s) > 1 else 0.0
    return (len(times_s) - 1) / span_s if span_s > 0.0 else 0.0
