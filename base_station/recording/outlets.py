"""How calls reach a writer: at once, or through a queue; neither raises, neither waits."""

import logging
import queue
import threading
from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from base_station.recording import streams

LEAVE_S = 2.0
QUEUE_LENGTH = 500
UNLIMITED = 0

Call = Callable[[], object]
log = logging.getLogger(__name__)


class Inline:
    """Runs calls at once. The first failure is logged; `failures` counts them."""

    def __init__(self) -> None:
        self.failures = 0

    def put(self, call: Call) -> None:
        try:
            call()
        except Exception:
            self.failures += 1
            if self.failures == 1:
                log.warning("the recorder failed; the run goes on", exc_info=True)

    def close(self) -> bool:
        return True


class Queued:
    """Runs calls one after the other in a thread of its own.

    With a limit it drops calls when so many wait, and closing gives up after `LEAVE_S`. With
    `UNLIMITED` nothing is lost, and closing waits until all has run.
    """

    def __init__(self, limit: int = QUEUE_LENGTH) -> None:
        self.dropped = 0
        self._leave_s = None if limit == UNLIMITED else LEAVE_S
        self._inline = Inline()
        self._calls: queue.Queue[Call | None] = queue.Queue(limit)
        self._thread = threading.Thread(target=self._run, daemon=True, name="recorder")
        self._thread.start()

    @property
    def failures(self) -> int:
        return self._inline.failures

    def put(self, call: Call) -> None:
        try:
            self._calls.put_nowait(call)
        except queue.Full:
            self.dropped += 1

    def close(self) -> bool:
        """Let it finish; False when it did not."""
        try:
            self._calls.put(None, timeout=self._leave_s)
        except queue.Full:
            return False
        self._thread.join(self._leave_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (call := self._calls.get()) is not None:
            self._inline.put(call)


class Closable(Protocol):
    def close(self) -> None: ...


W = TypeVar("W", bound=Closable)


class Channel(Generic[W]):
    """A writer and the way to it. The writer is made where its calls run."""

    def __init__(self, outlet: Inline | Queued, make: Callable[[], W | None]) -> None:
        self.outlet, self._make = outlet, make
        self._writer: W | None = None
        self._closed = False
        outlet.put(self._open)

    def tell(self, call: Callable[[W], None]) -> None:
        if not self._closed:
            self.outlet.put(lambda: call(self._writer) if self._writer is not None else None)

    def close(self) -> None:
        self.tell(lambda writer: writer.close())
        if not self._closed and not self.outlet.close():
            streams.abandon()
        self._closed = True

    def _open(self) -> None:
        self._writer = self._make()
