"""The log of a run: takes what the station and the world say, keeps and shows it.

Both backends, UDP and memory, talk to one of these; what is scored comes from here only.
"""

import json
from pathlib import Path
from types import TracebackType
from typing import Any

from hil.bench.console import Console
from hil.bench.lines import (
    Outcome,
    Progress,
    ResultLine,
    StationEvent,
    StationLine,
    Tick,
    as_station_line,
)
from hil.bench.record import RunRecord, Struck, describe_fault
from hil.bench.recording import TruthObserver
from hil.scenario import FaultModel, Scenario
from hil.world.truth import ContactEpisode, TruthRecord, contact_line, truth_line

TRUTH_FILE, EVENTS_FILE = "truth.jsonl", "events.jsonl"


class RunLog:
    """Writes events.jsonl and truth.jsonl as things happen, and feeds the console."""

    def __init__(
        self, scenario: Scenario, folder: Path, console: Console, observer: TruthObserver | None
    ) -> None:
        self._scenario, self._console, self._observer = scenario, console, observer
        self._events = (folder / EVENTS_FILE).open("w", encoding="utf-8", buffering=1)
        self._truth_file = (folder / TRUTH_FILE).open("w", encoding="utf-8", buffering=1)
        self._truth: TruthRecord | None = None
        self._contacts: list[ContactEpisode] = []
        self._struck: list[Struck] = []
        self.outcome: Outcome | None = None
        self.tick_s: float | None = None  # fleet time of the station's last tick
        self.learning = False  # whether it was in a phase of learning then

    def __enter__(self) -> "RunLog":
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self._events.close()
        self._truth_file.close()
        if self._observer:
            self._observer.close()

    @property
    def world_s(self) -> float:
        """World time as last heard; 0 before the first truth."""
        return self._truth.time_s if self._truth else 0.0

    def station(self, tree: dict[str, Any]) -> None:
        """A line of the station as an object. Raises ProcessDiedError on a broken one."""
        self.station_line(as_station_line(tree))

    def station_line(self, line: StationLine) -> None:
        match line:
            case Tick():
                self.tick_s = line.time_s
                self.learning = line.phase.startswith("plan_")
                self._console.tick(line)
            case StationEvent():
                self._write_event(line)
            case Progress():
                self._console.progress(line)
            case ResultLine():
                self.outcome = line.outcome
            case _:
                pass

    def truth(self, record: TruthRecord) -> None:
        self._truth = record
        self._truth_file.write(truth_line(record) + "\n")
        if self._observer:
            self._observer.truth(record)

    def contact(self, episode: ContactEpisode) -> None:
        self._contacts.append(episode)
        self._truth_file.write(contact_line(episode) + "\n")
        if self._observer:
            self._observer.contact(episode)

    def struck(self, fault: FaultModel, time_s: float) -> None:
        """The injector's orders for a fault have been confirmed."""
        self._struck.append(Struck(fault, time_s))
        self._tell_fault(fault, time_s, describe_fault(self._scenario, fault))

    def mended(self, fault: FaultModel, time_s: float) -> None:
        """A fault has ended, as the scenario says. It stays one of those that have struck."""
        self._tell_fault(fault, time_s, f"{describe_fault(self._scenario, fault)} ends")

    def _tell_fault(self, fault: FaultModel, time_s: float, text: str) -> None:
        data = fault.model_dump(mode="json", exclude={"onset"})
        if self._observer:
            self._observer.fault(time_s, text)
        self._write_event(
            StationEvent(type="event", time_s=round(time_s, 3), kind="fault", text=text, data=data)
        )

    def record(self) -> RunRecord:
        """All of it, for the score."""
        return RunRecord(self.outcome, self._truth, tuple(self._contacts), tuple(self._struck))

    def _write_event(self, event: StationEvent) -> None:
        tree = event.model_dump(mode="json", exclude={"type"})
        self._events.write(json.dumps(tree, ensure_ascii=False) + "\n")
        self._console.event(event)
