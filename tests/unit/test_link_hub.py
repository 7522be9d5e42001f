"""A socket with a host and guests: who is let in, who is forgotten, whom nobody displaces."""

import select
import socket
from collections.abc import Iterator

import pytest

from hil.link import GUEST_FORGOTTEN_S, MAX_GUESTS, UdpHub

HOST = "127.0.0.1"


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def sockets() -> Iterator[list[socket.socket]]:
    """The host's, and enough for guests."""
    made = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(MAX_GUESTS + 3)]
    for sock in made:
        sock.bind((HOST, 0))
        sock.settimeout(5.0)
    yield made
    for sock in made:
        sock.close()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def hub(sockets: list[socket.socket], clock: Clock) -> Iterator[UdpHub]:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind((HOST, 0))
    hub = UdpHub(sock, sockets[0].getsockname(), lambda data: data.startswith(b"hello"), clock)
    hub.address = sock.getsockname()  # type: ignore[attr-defined]
    yield hub
    hub.close()


def said(hub: UdpHub, sock: socket.socket, data: bytes) -> list[tuple[int, bytes]]:
    sock.sendto(data, hub.address)  # type: ignore[attr-defined]
    assert select.select([hub], [], [], 5.0)[0]
    return [(peer, data) for peer in hub.peers() for data in hub.end(peer).receive()]


def test_the_host_is_spoken_to_first_and_never_displaced(
    hub: UdpHub, sockets: list[socket.socket]
) -> None:
    host, guest, *_ = sockets
    assert said(hub, guest, b"hello") == [(1, b"hello")]
    hub.end(0).send(b"to the host")
    hub.end(1).send(b"to the guest")
    assert host.recv(100) == b"to the host"
    assert guest.recv(100) == b"to the guest"
    assert said(hub, host, b"anything") == [(0, b"anything")]


def test_who_is_not_welcome_is_not_heard_until_it_behaves(
    hub: UdpHub, sockets: list[socket.socket]
) -> None:
    guest = sockets[1]
    assert said(hub, guest, b"noise") == []
    assert hub.peers() == (0,)
    assert said(hub, guest, b"hello") == [(1, b"hello")]
    assert said(hub, guest, b"noise") == [(1, b"noise")]


def test_guests_are_bounded_and_forgotten(
    hub: UdpHub, sockets: list[socket.socket], clock: Clock
) -> None:
    for sock in sockets[1 : MAX_GUESTS + 1]:
        assert said(hub, sock, b"hello")
    late = sockets[MAX_GUESTS + 1]
    assert said(hub, late, b"hello") == []
    clock.now_s = GUEST_FORGOTTEN_S
    assert said(hub, sockets[1], b"still here") == [(1, b"still here")]
    clock.now_s += 1.0
    assert said(hub, late, b"hello") == [(MAX_GUESTS + 1, b"hello")]
    assert hub.peers() == (0, 1, MAX_GUESTS + 1)
    hub.end(2).send(b"nobody")  # is dropped


def test_an_absent_host_does_no_harm(hub: UdpHub, sockets: list[socket.socket]) -> None:
    sockets[0].close()
    for _ in range(3):
        hub.end(0).send(b"anybody?")
    assert hub.end(0).receive() == []
