"""The recorder: hears what the station tells and shows it in Rerun. It only listens.

It never raises into the station and never holds it up: the file is written by one thread, which
loses nothing, and a viewer is fed by another, which drops what it cannot deliver.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from base_station.parts import Room
from base_station.planning.requests import PlanProgress, PlanReady, Training
from base_station.recording import streams
from base_station.recording.blueprint import blueprint
from base_station.recording.files import FileWriter
from base_station.recording.outlets import UNLIMITED, Channel, Queued
from base_station.recording.writer import Teller, Writer
from base_station.records import Event, Snapshot
from hil.scenario import StationView


class Recorder:
    """Writes `path` and, where asked and one answers, feeds a viewer.

    `viewer` is its address as host:port. Recordings of one `run_id` are one recording, whoever
    writes them. A file that is full, as `room` has it, is followed by another.
    """

    def __init__(
        self,
        path: Path,
        run_id: str,
        view: StationView,
        viewer: str | None = None,
        room: Room | None = None,
    ) -> None:
        in_files = partial(FileWriter, path, run_id, view, room or Room())
        self._channels: list[Channel[Teller]] = [Channel(Queued(UNLIMITED), in_files)]
        if viewer:
            self._channels.append(Channel(Queued(), partial(_viewer_writer, viewer, run_id, view)))

    @property
    def failures(self) -> int:
        """Calls that went wrong so far; each was swallowed."""
        return sum(c.outlet.failures for c in self._channels)

    def snapshot(self, snapshot: Snapshot) -> None:
        self._tell(lambda writer: writer.snapshot(snapshot))

    def event(self, event: Event) -> None:
        self._tell(lambda writer: writer.event(event))

    def progress(self, progress: PlanProgress) -> None:
        self._tell(lambda writer: writer.progress(progress))

    def training(self, training: Training) -> None:
        self._tell(lambda writer: writer.training(training))

    def plan(self, answer: PlanReady) -> None:
        self._tell(lambda writer: writer.plan(answer))

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None:
        """Telemetry logs hold these."""

    def result(self, outcome: Mapping[str, Any]) -> None:
        """The events have told it already."""

    def close(self) -> None:
        """Everything is in the file afterwards. May be called twice."""
        for channel in self._channels:
            channel.close()

    def _tell(self, call: Callable[[Teller], None]) -> None:
        for channel in self._channels:
            channel.tell(call)


def _viewer_writer(address: str, run_id: str, view: StationView) -> Writer | None:
    stream = streams.to_viewer(address, run_id, blueprint(view))
    return stream and Writer(stream, run_id, view, streams.VIEWER_PERIOD_S)
