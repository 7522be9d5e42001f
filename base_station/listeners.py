"""Listeners that write: telemetry logs, events.jsonl, and lines for whoever started the station."""

import json
import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from base_station.journal import event_tree
from base_station.listening import Listener
from base_station.parts import Room, next_part, parts_of
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

    name = "the telemetry log"

    def __init__(
        self, folder: Path, view: StationView, append: bool = False, room: Room | None = None
    ) -> None:
        self._firsts = [folder / f"{m.name}.tlog" for m in view.fleet]
        self._room = room or Room()
        self._logs = [TlogWriter(_begun(first, append), append) for first in self._firsts]

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None:
        self._logs[index].write(time_us, datagram)
        if self._logs[index].size >= self._room.part_bytes:
            self._begin_part(index)

    def _begin_part(self, index: int) -> None:
        first = self._firsts[index]
        self._logs[index].close()
        self._room.make(first.parent)
        self._logs[index] = TlogWriter(next_part(first))

    def close(self) -> None:
        """All of them, even where one cannot write its rest. Raises OSError."""
        with ExitStack() as stack:
            for log in self._logs:
                stack.callback(log.close)


class Lines(Silent):
    """Everything worth telling as small JSON objects, handed to `write` one by one."""

    def __init__(self, write: Callable[[dict[str, Any]], None]) -> None:
        self._write = write

    def snapshot(self, snapshot: Snapshot) -> None:
        self._write({"type": "tick", "time_s": snapshot.time_s, "phase": snapshot.phase})

    def event(self, event: Event) -> None:
        self._write({"type": "event", **event_tree(event)})

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

    name = "events.jsonl"

    def __init__(self, path: Path, append: bool = False) -> None:
        """`append` goes on with what there is, without a line that was cut off."""
        if append and path.exists():
            os.truncate(path, path.read_bytes().rfind(b"\n") + 1)
        self._file = path.open("a" if append else "w", encoding="utf-8")

    def event(self, event: Event) -> None:
        self._file.write(json.dumps(event_tree(event)) + "\n")
        self._file.flush()

    def close(self) -> None:
        self._file.close()


def _begun(first: Path, append: bool) -> Path:
    """The part to go on with; a log that begins anew leaves no parts of one before."""
    if append:
        return [first, *parts_of(first)][-1]
    for old in parts_of(first):
        if old != first:
            old.unlink()
    return first


def _close(listener: TelemetryLogs | EventLog | Recorder) -> None:
    with suppress(OSError):  # a full disk has been heard of already
        listener.close()


def open_listeners(
    stack: ExitStack,
    folder: Path,
    run_id: str,
    view: StationView,
    viewer: str | None,
    say: Callable[[dict[str, Any]], None],
    resumed: int = 0,
    room: Room | None = None,
) -> list[Listener]:
    """Everything that listens to a station: telemetry logs, events, recording, lines.

    They write into `folder` and are closed by `stack`. One that was `resumed` goes on with the
    files of the one before, but for the recording, which gets a part of its own. `room` bounds
    logs and recording.
    """
    room = room or Room()
    logs = TelemetryLogs(folder, view, append=resumed > 0, room=room)
    events = EventLog(folder / "events.jsonl", append=resumed > 0)
    first = folder / "station.rrd"
    recording = next_part(first) if resumed else _begun(first, append=False)
    recorder = Recorder(recording, run_id, view, viewer=viewer, room=room)
    for listener in (logs, events, recorder):
        stack.callback(_close, listener)
    return [logs, events, recorder, Lines(say)]
