"""The recording as files, one after the other, each whole in itself."""

from pathlib import Path

from base_station.parts import Room, next_part
from base_station.planning.requests import PlanProgress, PlanReady, Training
from base_station.recording import streams
from base_station.recording.blueprint import blueprint
from base_station.recording.brief import Brief
from base_station.recording.writer import Writer
from base_station.records import Event, Snapshot
from hil.scenario import StationView

LOOK_EVERY = 100  # snapshots, at the size of the file


class FileWriter:
    """A `Writer`, and the next one once its file is full. To be used from one thread."""

    def __init__(self, path: Path, run_id: str, view: StationView, room: Room) -> None:
        self._run_id, self._view, self._room = run_id, view, room
        self._snapshots = 0
        self._begin(path, None)

    def _begin(self, path: Path, brief: Brief | None) -> None:
        self._path = path
        stream = streams.to_file(path, self._run_id, blueprint(self._view))
        self._writer = Writer(stream, self._run_id, self._view, streams.FILE_PERIOD_S, brief)

    def snapshot(self, snapshot: Snapshot) -> None:
        self._snapshots += 1
        if self._snapshots % LOOK_EVERY == 0 and self._is_full():
            self._writer.close()
            self._room.make(self._path.parent)
            self._begin(next_part(self._path.with_stem("station")), self._writer.brief)
        self._writer.snapshot(snapshot)

    def _is_full(self) -> bool:
        return self._path.stat().st_size >= self._room.part_bytes

    def event(self, event: Event) -> None:
        self._writer.event(event)

    def progress(self, progress: PlanProgress) -> None:
        self._writer.progress(progress)

    def training(self, training: Training) -> None:
        self._writer.training(training)

    def plan(self, ready: PlanReady) -> None:
        self._writer.plan(ready)

    def close(self) -> None:
        self._writer.close()
