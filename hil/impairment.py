"""A radio link as it is: datagrams get lost, late, doubled and out of order, in both directions.

Every datagram costs the same random draws, whatever becomes of it, so one seed and one sequence
of datagrams give one outcome.
"""

import heapq
from collections.abc import Callable, Iterator

import numpy as np

from hil.link import Link
from hil.scenario import Radio, Scenario

HELD_BACK_S = 0.2  # how much later a duplicate, or a datagram out of order, comes
_STREAM = 0x5241444F
_BLOCK = 256
_OUT, _IN = 0, 1


def impaired(link: Link, scenario: Scenario, sysid: int, clock: Callable[[], float]) -> Link:
    """The MAVLink link of a vehicle as its radio makes it; `clock` gives its time (s)."""
    radio = scenario.vehicle(sysid).radio or scenario.radio
    if radio == Radio():
        return link
    return ImpairedLink(link, radio, (scenario.seed, sysid), clock)


class ImpairedLink:
    """Wraps one end of a link. What is late leaves at the first call after its time."""

    def __init__(
        self, link: Link, radio: Radio, seed: tuple[int, ...], clock: Callable[[], float]
    ) -> None:
        self._link, self._clock = link, clock
        self._out = _Way(radio, (*seed, _STREAM, _OUT))
        self._in = _Way(radio, (*seed, _STREAM, _IN))

    def send(self, datagram: bytes) -> None:
        """To the peer, now, later, twice or never."""
        self._out.put(datagram, self._clock())
        self._flush()

    def receive(self) -> list[bytes]:
        """What has come through by now."""
        self._flush()
        for datagram in self._link.receive():
            self._in.put(datagram, self._clock())
        return self._in.due(self._clock())

    def _flush(self) -> None:
        for datagram in self._out.due(self._clock()):
            self._link.send(datagram)


class _Way:
    """One direction: datagrams under way, by the time they arrive."""

    def __init__(self, radio: Radio, seed: tuple[int, ...]) -> None:
        self._radio, self._draws = radio, _uniform(seed)
        self._under_way: list[tuple[float, int, bytes]] = []
        self._count = 0
        self._last_s = 0.0

    def put(self, datagram: bytes, now_s: float) -> None:
        lost, doubled, swapped, jitter = next(self._draws)
        radio = self._radio
        if lost < radio.loss:
            return
        arrives_s = now_s + radio.delay_s + radio.jitter_s * jitter
        if swapped < radio.reordering:
            self._add(arrives_s + HELD_BACK_S, datagram)
        else:
            self._last_s = max(self._last_s, arrives_s)  # jitter alone keeps the order
            self._add(self._last_s, datagram)
        if doubled < radio.duplication:
            self._add(arrives_s + HELD_BACK_S, datagram)

    def due(self, now_s: float) -> list[bytes]:
        datagrams = []
        while self._under_way and self._under_way[0][0] <= now_s + 1e-9:
            datagrams.append(heapq.heappop(self._under_way)[2])
        return datagrams

    def _add(self, arrives_s: float, datagram: bytes) -> None:
        heapq.heappush(self._under_way, (arrives_s, self._count, datagram))
        self._count += 1


def _uniform(seed: tuple[int, ...]) -> Iterator[list[float]]:
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    while True:
        yield from rng.random((_BLOCK, 4)).tolist()
