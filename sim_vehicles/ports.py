"""The MAVLink ports of a vehicle: one for each station, and the injector's (no sockets).

In: `receive` -> port -> service -> answers in the outbox of the same port. Out: `step` queues the
streams that are due, `tell` what everybody shall know, `drain` hands all of it over.
"""

from collections.abc import Callable, Collection, Sequence
from typing import Literal

from hil.mavlink import Message, StatusText
from sim_vehicles.port import Port

PortName = Literal["gcs", "injector"]


class Ports:
    """`station_port` makes a port for one more station; number 0 is there from the start."""

    def __init__(self, injector: Port, station_port: Callable[[int], Port]) -> None:
        self._injector, self._station_port = injector, station_port
        self._stations = {0: station_port(0)}

    def receive(self, name: PortName, datagram: bytes, peer: int, now_s: float) -> None:
        """Hand a datagram to the port it came in by; a new peer gets one of its own."""
        self._port(name, peer).receive(datagram, now_s)

    def keep(self, peers: Collection[int]) -> None:
        """Forget the stations that are not among these; number 0 stays."""
        for gone in self._stations.keys() - {0, *peers}:
            del self._stations[gone]

    def drain(self, name: PortName, peer: int) -> list[bytes]:
        """Frames to send since the last call, oldest first."""
        return self._port(name, peer).drain()

    def step(self, now_s: float) -> None:
        """Queue the streams that are due, on all ports."""
        for port in (*self._stations.values(), self._injector):
            port.step(now_s)

    def tell(self, messages: Sequence[Message]) -> None:
        """To every station; the injector gets the texts."""
        if messages:
            for port in self._stations.values():
                port.send(messages)
            self._injector.send(m for m in messages if isinstance(m, StatusText))

    def _port(self, name: PortName, peer: int) -> Port:
        if name == "injector":
            return self._injector
        if peer not in self._stations:
            self._stations[peer] = self._station_port(peer)
        return self._stations[peer]
