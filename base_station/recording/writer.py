"""Station messages to rows of a recording."""

from typing import Any, Protocol

import rerun as rr

from base_station.planning.requests import PlanProgress, PlanReady, Training
from base_station.recording.brief import Brief
from base_station.recording.columns import Batch, set_time
from base_station.recording.fleet_rows import FleetRows
from base_station.recording.learning import LearningRows
from base_station.recording.legend import log_legend
from base_station.recording.scene import log_scene
from base_station.recording.twin_rows import TwinRows
from base_station.records import Event, EventKind, Snapshot
from hil.scenario import StationView

LEVELS: dict[EventKind, str] = {"anomaly": "WARN", "takeover": "WARN", "command": "WARN"}


class Teller(Protocol):
    """Takes what the station tells."""

    def snapshot(self, snapshot: Snapshot) -> None: ...

    def event(self, event: Event) -> None: ...

    def progress(self, progress: PlanProgress) -> None: ...

    def training(self, training: Training) -> None: ...

    def plan(self, ready: PlanReady) -> None: ...

    def close(self) -> None: ...


class Writer:
    """Writes one stream, from one thread. Errors of the recording library come through.

    `brief` is that of the stream before, where this one goes on.
    """

    def __init__(
        self,
        stream: Any,
        run_id: str,
        view: StationView,
        period_s: float,
        brief: Brief | None = None,
    ) -> None:
        self._stream = stream
        self._batch = Batch(stream, period_s)
        self._fleet = FleetRows(self._batch, view)
        self._twins = TwinRows(self._batch, stream, view)
        self._learning = LearningRows(stream, len(view.fleet))
        self.brief = brief or Brief(run_id, view)
        self._states: dict[str, str] = {}
        self._now_s = 0.0
        log_scene(stream, view)
        log_legend(stream, view)
        self._write_brief(0.0)

    def snapshot(self, snapshot: Snapshot) -> None:
        """The station's belief at one instant."""
        self._now_s = snapshot.time_s
        self._batch.tick(snapshot.time_s)
        self._fleet.add(snapshot)
        self._twins.add(snapshot.time_s, snapshot.twins)
        for vehicle in snapshot.vehicles:
            self._state(vehicle.name, vehicle.phase)
        if self._state("fleet", snapshot.phase):
            self._learning.phase(snapshot.phase)
        set_time(self._stream, snapshot.time_s)
        self._learning.experiment(snapshot.foreseen)

    def event(self, event: Event) -> None:
        """One line of the log; verdict and end also rewrite the brief."""
        set_time(self._stream, event.time_s)
        line = rr.TextLog(f"{event.kind}: {event.text}", level=LEVELS.get(event.kind, "INFO"))
        self._stream.log(f"/events/{event.kind}", line)
        if self.brief.hear(event):
            self._write_brief(event.time_s)

    def progress(self, progress: PlanProgress) -> None:
        set_time(self._stream, self._now_s)
        self._learning.progress(progress)

    def training(self, training: Training) -> None:
        set_time(self._stream, self._now_s)
        self._learning.training(training)

    def plan(self, ready: PlanReady) -> None:
        set_time(self._stream, self._now_s)
        self._learning.plan(ready)

    def close(self) -> None:
        """Everything kept back goes out, and the stream ends."""
        self._batch.send()
        self._stream.disconnect()

    def _state(self, who: str, state: str) -> bool:
        if self._states.get(who) == state:
            return False
        self._states[who] = state
        set_time(self._stream, self._now_s)
        self._stream.log(f"/phase/{who}", rr.StateChange(state=state))
        return True

    def _write_brief(self, time_s: float) -> None:
        set_time(self._stream, time_s)
        page = rr.TextDocument(self.brief.markdown(), media_type=rr.MediaType.MARKDOWN)
        self._stream.log("/brief", page)
