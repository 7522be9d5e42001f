"""Links carry datagrams. The same code runs over UDP and over memory."""

import socket
from collections import deque
from contextlib import suppress
from typing import Protocol, Self

Address = tuple[str, int]

# Where processes started by hand meet: the ports of ArduPilot's simulator, of QGroundControl, and
# of our own. Vehicle i of the fleet uses base + 10 i.
PHYSICS_PORT_BASE, MAVLINK_PORT_BASE, INJECTOR_PORT_BASE = 9002, 14550, 15550


class Link(Protocol):
    """A non-blocking datagram link with one peer."""

    def send(self, datagram: bytes) -> None:
        """Send to the peer; silently dropped while the peer is unknown."""

    def receive(self) -> list[bytes]:
        """All datagrams that have arrived, oldest first."""


class MemoryLink:
    """One end of a lossless in-memory link; make both ends with `pair`."""

    def __init__(self, inbox: deque[bytes], outbox: deque[bytes]) -> None:
        self._inbox, self._outbox = inbox, outbox

    @classmethod
    def pair(cls) -> tuple[Self, Self]:
        a: deque[bytes] = deque()
        b: deque[bytes] = deque()
        return cls(a, b), cls(b, a)

    def send(self, datagram: bytes) -> None:
        self._outbox.append(datagram)

    def receive(self) -> list[bytes]:
        datagrams = list(self._inbox)
        self._inbox.clear()
        return datagrams


class UdpLink:
    """A UDP socket with one peer: given (`connect`), or learnt from the last sender (`bind`)."""

    def __init__(self, sock: socket.socket, peer: Address | None) -> None:
        sock.setblocking(False)
        self._socket, self._peer = sock, peer

    @classmethod
    def bind(cls, host: str, port: int) -> Self:
        """Wait for whoever speaks first. Raises OSError when the port is taken."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.bind((host, port))
        except OSError:
            sock.close()
            raise
        return cls(sock, None)

    @classmethod
    def connect(cls, host: str, port: int) -> Self:
        """Speak to a known address."""
        return cls(socket.socket(socket.AF_INET, socket.SOCK_DGRAM), (host, port))

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def send(self, datagram: bytes) -> None:
        if self._peer is None:
            return
        # UDP: a full buffer or an absent peer loses the datagram, as on the air
        with suppress(BlockingIOError, ConnectionRefusedError):
            self._socket.sendto(datagram, self._peer)

    def receive(self) -> list[bytes]:
        datagrams: list[bytes] = []
        while True:
            try:
                data, sender = self._socket.recvfrom(65535)
            except BlockingIOError:
                return datagrams
            except ConnectionRefusedError:
                continue  # the peer was not there for an earlier datagram
            self._peer = sender
            datagrams.append(data)

    def close(self) -> None:
        self._socket.close()
