"""Before a vehicle is driven: rates, settings, its origin, its clock and how far away it is.

Pure: what is heard goes in, commands and words come out. `wall_s` is any monotonic clock.
"""

from collections import deque
from collections.abc import Mapping

from base_station.autopilots import Autopilot, Rate, Setting
from base_station.commands import AskRate, AskTime, Command, RequestMessage, SetParameter
from hil import mavlink
from hil.scenario import FleetMember

REPEAT_S = 1.0
ASK_TIME_S = 0.1
ANSWERS = 5  # to TIMESYNC, until the link's delay and its spread are known
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
        self._answers = 0
        self._asked_time_s = float("-inf")
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
            case mavlink.Timesync(tc1_ns=answer) if answer:
                self._answers += 1
            case mavlink.ParamValue():
                for setting in self._read:
                    if value.name in setting.names:
                        self._read[setting] = self._autopilot.parameter(value)
            case _:
                pass
        if isinstance(value, mavlink.Message) and int(value.ID) in self._arrivals:
            self._arrivals[int(value.ID)].append(self._now_s)

    def asks(self, wall_s: float) -> list[Command]:
        """What is still to be asked, each second of wall time; the time more often."""
        sysid = self._member.sysid
        asked: list[Command] = []
        if self._answers < ANSWERS and wall_s - self._asked_time_s >= ASK_TIME_S:
            self._asked_time_s = wall_s
            asked.append(AskTime(sysid, int(wall_s * 1e9)))
        if wall_s - self._asked_s < REPEAT_S:
            return asked
        self._asked_s = wall_s
        commands: list[Command] = [*asked, *(AskRate(sysid, r.message, r.hz) for r in self._slow())]
        if not self._located:
            wanted = (mavlink.MessageId.GPS_GLOBAL_ORIGIN, mavlink.MessageId.HOME_POSITION)
            commands += [RequestMessage(sysid, message) for message in wanted]
        for setting in self._unset():
            commands += [SetParameter(sysid, name, setting.value) for name in setting.names]
        return commands

    @property
    def done(self) -> bool:
        """Settings read back, origin known, and rates and the time told or complained of."""
        told = not self._slow() and self._answers >= ANSWERS
        return not self._unset() and self._located and (told or self._settled)

    def warnings(self) -> tuple[str, ...]:
        """Rates that are not honoured, and a time that is not told, in words, once."""
        if self.warned or not self._settled:
            return ()
        self.warned = True
        rates = self.measured_hz()
        silent = f"{self._member.name} does not answer TIMESYNC: its link's delay is not known"
        return (silent,) * (not self._answers) + tuple(
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
