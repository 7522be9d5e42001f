"""Attempts side by side in worker processes; which of them wins does not depend on timing.

Attempt k has a seed of its own, so it comes out the same wherever and whenever it is made. The
lowest-numbered success wins: those above it are stopped, those below it are awaited.
"""

import multiprocessing
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from types import TracebackType
from typing import Self

from base_station.planning.attempts import (
    Attempt,
    OnProgress,
    derived_seed,
    numbered,
)
from base_station.planning.requests import PlanProgress, PlanRequest
from base_station.planning.trying import try_of
from hil.errors import ProcessDiedError
from hil.scenario import StationView

WarmUp = Callable[[StationView], None]


class Stopped(Exception):  # noqa: N818
    """Raised in a worker whose attempt is no longer wanted."""


def team_size(asked: int, cores: int | None = None) -> int:
    """Workers for `planning.workers`; 0 asks for all cores but the one that the station needs."""
    return asked or max(1, (cores or os.cpu_count() or 1) - 1)


class Team:
    """`size` processes that wait for attempts at requests about `view`."""

    def __init__(self, view: StationView, size: int, warm_up: WarmUp) -> None:
        context = multiprocessing.get_context("spawn")
        self._links: list[Connection] = []
        for _ in range(size):
            ours, theirs = context.Pipe()
            worker = context.Process(target=_work, args=(theirs, view, warm_up), daemon=True)
            worker.start()
            theirs.close()
            self._links.append(ours)
        for link in self._links:
            _receive(link)  # ready

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        for link in self._links:
            link.close()  # workers end when their link does

    def __call__(
        self, view: StationView, request: PlanRequest, on_progress: OnProgress
    ) -> tuple[Attempt, ...]:
        """Attempts 0 to the winner, or all of them. Raises ProcessDiedError if a worker is gone."""
        board = Board(view.planning.restarts + 1)
        idle, busy = list(self._links), dict[Connection, int]()
        while True:
            while idle and (k := board.due()) is not None:
                link = idle.pop()
                busy[link] = k
                link.send((request, k))
            if not busy:
                return board.result()
            heard = wait(list(busy))
            for link in [one for one in busy if one in heard]:
                told = _receive(link)
                if isinstance(told, PlanProgress):
                    on_progress(told)
                    continue
                idle.append(link)
                if told is not None:
                    board.enter(busy[link], told)
                del busy[link]
                for other, k in busy.items():
                    if board.unwanted(k):
                        other.send(None)


@dataclass
class Board:
    """Which attempts are out, back, and still of interest."""

    limit: int

    def __post_init__(self) -> None:
        self._begun = 0
        self._back: dict[int, Attempt] = {}
        self._winner: int | None = None

    def due(self) -> int | None:
        """The next attempt to begin, None when there is no need for one."""
        if self._winner is not None or self._begun == self.limit:
            return None
        self._begun += 1
        return self._begun - 1

    def enter(self, k: int, attempt: Attempt) -> None:
        self._back[k] = attempt
        if attempt.accepted and (self._winner is None or k < self._winner):
            self._winner = k

    def unwanted(self, k: int) -> bool:
        return self._winner is not None and k > self._winner

    def result(self) -> tuple[Attempt, ...]:
        """As if they had been made one after the other."""
        last = self.limit - 1 if self._winner is None else self._winner
        return tuple(self._back[k] for k in range(last + 1))


def _receive(link: Connection) -> PlanProgress | Attempt | None:
    try:
        told: PlanProgress | Attempt | None = link.recv()
    except (EOFError, ConnectionResetError):
        raise ProcessDiedError("a planner's worker died; its last words are above") from None
    return told


def _work(link: Connection, view: StationView, warm_up: WarmUp) -> None:
    """In the worker: attempts until the link closes; None means: stop, or: stopped."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warm_up(view)
    link.send(None)
    try:
        while True:
            if (job := link.recv()) is not None:  # None: too late, that attempt is over
                link.send(_attempt(link, view, *job))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def _attempt(link: Connection, view: StationView, request: PlanRequest, k: int) -> Attempt | None:
    def on_progress(progress: PlanProgress) -> None:
        if link.poll():
            link.recv()
            raise Stopped
        link.send(progress)

    _, attempt_once = try_of(view, request)
    try:
        return attempt_once(
            view, request, derived_seed(request.seed, k), numbered(request, k, on_progress)
        )
    except Stopped:
        return None
