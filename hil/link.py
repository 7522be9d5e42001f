"""Links carry datagrams. The same code runs over UDP and over memory."""

import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from ipaddress import ip_address
from typing import Protocol, Self

Address = tuple[str, int]
MAX_GUESTS = 4
GUEST_FORGOTTEN_S = 30.0
PEER_FORGOTTEN_S = 2.0
LOCALHOST = "127.0.0.1"
RECEIVE_BYTES = 1 << 20  # strangers may not crowd out who belongs here


def make_room(sock: socket.socket) -> None:
    """Never wait for this socket, and let much wait in it: as much as the system grants."""
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)


def is_here(host: str) -> bool:
    """Whether an address, or name, is one that other machines cannot reach."""
    try:
        return ip_address(socket.gethostbyname(host)).is_loopback
    except (OSError, ValueError):
        return False


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
    """A UDP socket with one peer: given (`connect`), or the first who is welcome (`bind`).

    Nobody takes a peer's place while it speaks: what others send is dropped unread. After
    PEER_FORGOTTEN_S of silence, whoever is welcome then is the peer, as a vehicle that was started
    again and has another port. `now` is a monotonic clock in seconds.
    """

    def __init__(
        self,
        sock: socket.socket,
        peer: Address | None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        make_room(sock)
        self._socket, self._peer, self._now = sock, peer, now
        self._given = peer is not None
        self._heard_s = -float("inf")
        self._is_welcome: Callable[[bytes], bool] = lambda _datagram: True

    @classmethod
    def bind(cls, host: str, port: int) -> Self:
        """Wait for whoever speaks first. Raises OSError or OverflowError."""
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.bind((host, port))
        except (OSError, OverflowError):
            sock.close()
            raise
        return cls(sock, None)

    @classmethod
    def connect(cls, host: str, port: int) -> Self:
        """Speak to a known address, and listen to nobody else. Raises OSError."""
        address = (socket.gethostbyname(host), port)
        return cls(socket.socket(socket.AF_INET, socket.SOCK_DGRAM), address)

    def guard(self, is_welcome: Callable[[bytes], bool]) -> None:
        """Who may become the peer: those whose datagram this says of that it is welcome."""
        self._is_welcome = is_welcome

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
            if self._is_peer(sender, data):
                self._heard_s = self._now()
                datagrams.append(data)

    def _is_peer(self, sender: Address, data: bytes) -> bool:
        if sender == self._peer:
            return True
        if self._given or not self._is_welcome(data):
            return False
        if self._peer is not None and self._now() - self._heard_s <= PEER_FORGOTTEN_S:
            return False
        self._peer = sender
        return True

    def close(self) -> None:
        self._socket.close()


class UdpHub:
    """A UDP socket with a host, whose address is given, and with guests who come by themselves.

    Peers have numbers: 0 is the host, which nobody displaces, and guests count up from 1. A guest
    is let in by a datagram that is welcome; there are at most four, and one that has been silent
    for 30 s is forgotten. `now` is a monotonic clock in seconds.
    """

    def __init__(
        self,
        sock: socket.socket,
        host: Address,
        is_welcome: Callable[[bytes], bool],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        make_room(sock)
        self._socket, self._is_welcome, self._now = sock, is_welcome, now
        self._numbers: dict[Address, int] = {host: 0}
        self._heard_s: dict[Address, float] = {}  # guests alone
        self._invited = 0
        self._inboxes: dict[int, list[bytes]] = {}

    @classmethod
    def open(cls, host: Address, port: int, is_welcome: Callable[[bytes], bool]) -> Self:
        """Speak to the host, from a port (0: any). Raises OSError when that is taken.

        Guests come from this machine only, unless the host is on another.
        """
        sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            sock.bind((LOCALHOST if is_here(host[0]) else "", port))
        except OSError:
            sock.close()
            raise
        return cls(sock, host, is_welcome)

    def peers(self) -> tuple[int, ...]:
        """The numbers of all who are there now."""
        self._poll()
        return tuple(self._numbers.values())

    def fileno(self) -> int:
        """For `select`."""
        return self._socket.fileno()

    def end(self, peer: int) -> "HubEnd":
        """The link to one peer; what is sent after it has gone is dropped."""
        return HubEnd(self, peer)

    def send(self, peer: int, datagram: bytes) -> None:
        for address, number in self._numbers.items():
            if number == peer:
                with suppress(BlockingIOError, ConnectionRefusedError):  # UDP, as above
                    self._socket.sendto(datagram, address)

    def take(self, peer: int) -> list[bytes]:
        """What has arrived from one peer, oldest first."""
        self._poll()
        return self._inboxes.pop(peer, [])

    def _poll(self) -> None:
        """Sort what is there by who sent it; of strangers nothing is kept."""
        self._forget()
        while True:
            try:
                data, sender = self._socket.recvfrom(65535)
            except BlockingIOError:
                return
            except ConnectionRefusedError:
                continue
            number = self._number(sender, data)
            if number is not None:
                self._inboxes.setdefault(number, []).append(data)

    def _number(self, sender: Address, data: bytes) -> int | None:
        number = self._numbers.get(sender)
        if number is None:
            if len(self._heard_s) >= MAX_GUESTS or not self._is_welcome(data):
                return None
            self._invited += 1
            number = self._numbers[sender] = self._invited
        if number:
            self._heard_s[sender] = self._now()
        return number

    def _forget(self) -> None:
        now_s = self._now()
        for guest, heard_s in list(self._heard_s.items()):
            if now_s - heard_s > GUEST_FORGOTTEN_S:
                self._inboxes.pop(self._numbers.pop(guest), None)
                del self._heard_s[guest]

    def close(self) -> None:
        self._socket.close()


class HubEnd:
    """A hub's link to one of its peers."""

    def __init__(self, hub: UdpHub, peer: int) -> None:
        self._hub, self._peer = hub, peer

    def send(self, datagram: bytes) -> None:
        self._hub.send(self._peer, datagram)

    def receive(self) -> list[bytes]:
        return self._hub.take(self._peer)
