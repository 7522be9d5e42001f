"""Who listens to a station, and what happens when one of them cannot write any more."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from base_station.planning.requests import PlanProgress, PlanReady
from base_station.records import Event, Snapshot


class Listener(Protocol):
    """A passive listener: recorder, log, terminal. One that raises OSError is told no more."""

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None: ...

    def snapshot(self, snapshot: Snapshot) -> None: ...

    def event(self, event: Event) -> None: ...

    def progress(self, progress: PlanProgress) -> None: ...

    def plan(self, answer: PlanReady) -> None: ...

    def result(self, outcome: Mapping[str, Any]) -> None: ...


class Listeners:
    """All of them as one. `failure` says what cannot be written any more, and why."""

    def __init__(self, listeners: Sequence[Listener]) -> None:
        self._listeners = list(listeners)
        self.failure: str | None = None

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None:
        self._each(lambda listener: listener.datagram(index, time_us, datagram))

    def snapshot(self, snapshot: Snapshot) -> None:
        self._each(lambda listener: listener.snapshot(snapshot))

    def event(self, event: Event) -> None:
        self._each(lambda listener: listener.event(event))

    def progress(self, progress: PlanProgress) -> None:
        self._each(lambda listener: listener.progress(progress))

    def plan(self, answer: PlanReady) -> None:
        self._each(lambda listener: listener.plan(answer))

    def result(self, outcome: Mapping[str, Any]) -> None:
        self._each(lambda listener: listener.result(outcome))

    def _each(self, call: Callable[[Listener], None]) -> None:
        for listener in tuple(self._listeners):
            try:
                call(listener)
            except OSError as error:
                self._listeners.remove(listener)
                self.fail(getattr(listener, "name", type(listener).__name__), error)

    def fail(self, what: str, error: OSError) -> None:
        """The first failure counts."""
        self.failure = self.failure or f"{what} cannot be written: {error.strerror or error}"
