"""The station on its links: bytes to typed values, the step, and bytes again; and its listeners.

The same node runs over UDP (`process.py`) and over memory. All that it tells the outside goes to
listeners, which only listen.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from base_station.commands import encode
from base_station.outcome import PhaseTimes, outcome, training
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest
from base_station.records import Event, Snapshot
from base_station.station import Station
from hil.link import Link
from hil.mavlink import COMPONENT_GCS, Decoder, Encoder
from hil.scenario import StationView

LINGER_S = 1.0  # after the end, until every vehicle has confirmed HOLD


class Planner(Protocol):
    """Where plan requests go, and what has come back."""

    def submit(self, request: PlanRequest) -> None: ...

    def poll(self) -> list[PlanProgress | PlanReady]: ...


class Listener(Protocol):
    """A passive listener: recorder, log, terminal."""

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None: ...

    def snapshot(self, snapshot: Snapshot) -> None: ...

    def event(self, event: Event) -> None: ...

    def progress(self, progress: PlanProgress) -> None: ...

    def plan(self, answer: PlanReady) -> None: ...

    def result(self, outcome: Mapping[str, Any]) -> None: ...


class StationNode:
    """One station with a link per vehicle, in fleet order."""

    def __init__(
        self,
        view: StationView,
        links: Sequence[Link],
        planner: Planner,
        listeners: Sequence[Listener],
    ) -> None:
        self.station = Station(view)
        self._sysids = [m.sysid for m in view.fleet]
        self._links, self._planner, self._listeners = links, planner, listeners
        self._decoders = [Decoder() for _ in links]
        self._encoders = [Encoder(view.station_sysid, COMPONENT_GCS) for _ in links]
        self._phases = PhaseTimes()
        self._trainings: list[dict[str, Any]] = []
        self._ended_s: float | None = None
        self.finished = False

    def step(self, wall_s: float, epoch_us: int) -> None:
        """Receive, decide, send. `epoch_us` stamps the telemetry log."""
        received = []
        for index, (link, decoder) in enumerate(zip(self._links, self._decoders, strict=True)):
            for datagram in link.receive():
                self._log(index, epoch_us, datagram)
                received += [(index, message) for message in decoder.decode(datagram)]
        out = self.station.step(wall_s, received, self._answers())
        for command in out.commands:
            index = self._sysids.index(command.sysid)
            datagram = encode(command, self._encoders[index], self.station.autopilots[index])
            self._links[index].send(datagram)
            self._log(index, epoch_us, datagram)
        for listener in self._listeners:
            for event in out.events:
                listener.event(event)
            for snapshot in out.snapshots:
                listener.snapshot(snapshot)
        if out.request is not None:
            self._planner.submit(out.request)
        self._phases.at(self.station.desk.phase.name, wall_s, self.station.desk.time_s)
        self._finish()

    def _answers(self) -> list[PlanReady]:
        answers = []
        for message in self._planner.poll():
            if isinstance(message, PlanReady):
                answers.append(message)
                self._trainings.append(training(message))
                for listener in self._listeners:
                    listener.plan(message)
            else:
                for listener in self._listeners:
                    listener.progress(message)
        return answers

    def _finish(self) -> None:
        if not self.station.desk.ended or self.finished:
            return
        if self._ended_s is None:
            self._ended_s = self.station.desk.time_s
        if self.station.desk.time_s - self._ended_s >= LINGER_S:
            self.finished = True
            told = outcome(self.station.desk, self._phases, self._trainings)
            for listener in self._listeners:
                listener.result(told)

    def _log(self, index: int, epoch_us: int, datagram: bytes) -> None:
        for listener in self._listeners:
            listener.datagram(index, epoch_us, datagram)
