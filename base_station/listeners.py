"""Listeners that write: telemetry logs, events.jsonl, and lines for whoever started the station."""

import json
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from base_station.node import Listener
from base_station.planning.requests import PlanProgress, PlanReady
from base_station.recorder import Recorder
from base_station.records import Event, Snapshot
from base_station.tlog import TlogWriter
from hil.scenario import StationView


class Silent:
    """Hears everything, does nothing; the base of listeners that care for a part."""

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None: ...

    def snapshot(self, snapshot: Snapshot) -> None: ...

    def event(self, event: Event) -> None: ...

    def progress(self, progress: PlanProgress) -> None: ...

    def plan(self, answer: PlanReady) -> None: ...

    def result(self, outcome: Mapping[str, Any]) -> None: ...


class TelemetryLogs(Silent):
    """One .tlog per vehicle link, both directions."""

    def __init__(self, folder: Path, view: StationView) -> None:
        self._logs = [TlogWriter(folder / f"{m.name}.tlog") for m in view.fleet]

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None:
        self._logs[index].write(time_us, datagram)

    def close(self) -> None:
        for log in self._logs:
            log.close()


def event_line(event: Event) -> dict[str, Any]:
    """An event as plain JSON values; there is no wall time in it."""
    return {"time_s": event.time_s, "kind": event.kind, "text": event.text, "data": event.data}


class Lines(Silent):
    """Everything worth telling as small JSON objects, handed to `write` one by one."""

    def __init__(self, write: Callable[[dict[str, Any]], None]) -> None:
        self._write = write

    def snapshot(self, snapshot: Snapshot) -> None:
        self._write({"type": "tick", "time_s": snapshot.time_s, "phase": snapshot.phase})

    def event(self, event: Event) -> None:
        self._write({"type": "event", **event_line(event)})

    def progress(self, progress: PlanProgress) -> None:
        self._write(
            {
                "type": "progress",
                "kind": progress.kind,
                "attempt": progress.attempt,
                "timesteps": progress.timesteps,
                "total_timesteps": progress.total_timesteps,
                "mean_reward": progress.mean_reward,
            }
        )

    def result(self, outcome: Mapping[str, Any]) -> None:
        self._write({"type": "result", "outcome": dict(outcome)})


class EventLog(Silent):
    """events.jsonl, a line an event, on disk at once."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8")

    def event(self, event: Event) -> None:
        self._file.write(json.dumps(event_line(event)) + "\n")
        self._file.flush()

    def close(self) -> None:
        self._file.close()


def open_listeners(
    stack: ExitStack,
    folder: Path,
    run_id: str,
    view: StationView,
    viewer: str | None,
    say: Callable[[dict[str, Any]], None],
) -> list[Listener]:
    """Everything that listens to a station: telemetry logs, events, recording, lines.

    They write into `folder` and are closed by `stack`.
    """
    logs = TelemetryLogs(folder, view)
    events = EventLog(folder / "events.jsonl")
    recorder = Recorder(folder / "station.rrd", run_id, view, viewer=viewer)
    for listener in (logs, events, recorder):
        stack.callback(listener.close)
    return [logs, events, recorder, Lines(say)]
