"""Listens to a station for the table: alarms, beliefs, verdicts, and when they came."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from base_station.listeners import Silent
from base_station.records import Event, Snapshot
from hil.bench.labels import UNKNOWN


@dataclass(frozen=True)
class Alarm:
    time_s: float
    sysid: int


@dataclass(frozen=True)
class Judgement:
    """A verdict as it was told."""

    time_s: float
    sysid: int
    hypothesis: str
    decided: bool
    posterior: dict[str, float]


class Witness(Silent):
    """`clock` is world time: when somebody beside the station would have known."""

    def __init__(self, clock: Callable[[], float], look_after_s: Sequence[float]) -> None:
        self._clock, self._pending = clock, sorted(look_after_s)
        self.alarms: list[Alarm] = []
        self.verdicts: list[Judgement] = []
        self.posterior: dict[str, float] = {}  # before a verdict, as last told
        self.looks: dict[str, dict[str, float]] = {}
        self.experiments = 0
        self.ended = ""

    def event(self, event: Event) -> None:
        data: dict[str, Any] = event.data
        now_s = round(self._clock(), 4)
        match event.kind:
            case "anomaly":
                self.alarms.append(Alarm(now_s, data["sysid"]))
            case "hypotheses":
                self.posterior = dict(data["posterior"])
            case "verdict":
                told = data["sysid"], data["hypothesis"], data["decided"], dict(data["posterior"])
                self.verdicts.append(Judgement(now_s, *told))
            case "phase" if event.text == "experiment":
                self.experiments += 1
            case "end":
                self.ended = event.text
            case _:
                pass

    def snapshot(self, snapshot: Snapshot) -> None:
        if not self._pending or not self.alarms or len(snapshot.twins) < 2:  # no doubt is open
            return
        if self._clock() - self.alarms[0].time_s >= self._pending[0]:
            after_s = self._pending.pop(0)
            looked = {t.hypothesis: round(t.posterior, 6) for t in snapshot.twins}
            looked[UNKNOWN] = round(max(0.0, 1.0 - sum(looked.values())), 6)  # has no twin
            self.looks[f"{after_s:g}"] = looked
