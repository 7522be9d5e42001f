"""A radio link as it is: datagrams get lost, late, doubled, garbled and out of order, each way.

Every datagram costs the same random draws, whatever becomes of it, so one seed and one sequence
of datagrams give one outcome, over UDP as in memory.
"""

import heapq
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hil.link import Link
from hil.scenario import Radio, Scenario, in_effect

HELD_BACK_S = 0.2  # how much later a duplicate, or a datagram out of order, comes
_STREAM, _GARBLE_STREAM = 0x5241444F, 0x47415242
_PERFECT = Radio()
_BLOCK = 256
_OUT, _IN = 0, 1


def impaired(link: Link, scenario: Scenario, sysid: int, clock: Callable[[], float]) -> Link:
    """The vehicle's end of a MAVLink link as its radio makes it; `clock` gives its time (s)."""
    own = scenario.vehicle(sysid).radio
    radios = scenario.radio if own is None else own
    return ImpairedLink(link, radios, (scenario.seed, sysid), clock) if radios else link


class ImpairedLink:
    """Wraps the vehicle's end of a link. What is late leaves at the first call after its time.

    Of radios that hold at the same time, the first counts; where none does, the link is perfect.
    """

    def __init__(
        self,
        link: Link,
        radios: Sequence[Radio],
        seed: tuple[int, ...],
        clock: Callable[[], float],
    ) -> None:
        self._link, self._clock = link, clock
        self._out = _Way([r for r in radios if r.direction != "to_vehicle"], (*seed, _OUT))
        self._in = _Way([r for r in radios if r.direction != "to_station"], (*seed, _IN))

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

    def __init__(self, radios: Sequence[Radio], seed: tuple[int, ...]) -> None:
        *base, way = seed
        self._radios = radios
        self._draws = _uniform((*base, _STREAM, way), 4)
        self._garble_draws = _uniform((*base, _GARBLE_STREAM, way), 3)
        self._under_way: list[tuple[float, int, bytes]] = []
        self._count = 0
        self._last_s = 0.0

    def put(self, datagram: bytes, now_s: float) -> None:
        lost, doubled, swapped, jitter = next(self._draws)
        hit, where, how = next(self._garble_draws)
        radio = in_effect(self._radios, now_s) or _PERFECT
        if lost < radio.loss:
            return
        if hit < radio.corruption:
            datagram = _garbled(datagram, where, how)
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


def _garbled(datagram: bytes, where: float, how: float) -> bytes:
    """One byte is another one: a burst of up to eight bits, for the CRC-16 of MAVLink to notice."""
    if not datagram:
        return datagram
    at, mask = int(where * len(datagram)), 1 + int(how * 255)
    return datagram[:at] + bytes([datagram[at] ^ mask]) + datagram[at + 1 :]


def _uniform(seed: tuple[int, ...], width: int) -> Iterator[list[float]]:
    """Rows of `width` numbers in [0, 1), for ever."""
    rng = np.random.default_rng(np.random.SeedSequence(seed))
    while True:
        yield from rng.random((_BLOCK, width)).tolist()
