"""Carriers: one open connection each, over which one vehicle or many are spoken to."""

import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol, Self

import serial

from hil.connection import Connection
from hil.errors import InputError
from hil.link import Address, make_room
from hil.mavlink.stream import Frame, FrameCutter, frames_of

RECONNECT_S = 1.0
CONNECT_WITHIN_S = 5.0
Heard = tuple[Address | None, Frame]  # who it came from, where that can differ


class Carrier(Protocol):
    """Non-blocking. `peer` None means the one that was given; nobody, where none was."""

    def fileno(self) -> int: ...

    def receive(self) -> list[Heard]: ...

    def send(self, datagram: bytes, peer: Address | None) -> None: ...

    def close(self) -> None: ...


class UdpCarrier:
    """A UDP socket. `given` is whom it speaks to first; a bound one has nobody to speak to before
    it is told whom: that somebody has sent a datagram does not make a vehicle of him."""

    def __init__(self, sock: socket.socket, given: Address | None) -> None:
        make_room(sock)
        self._socket, self._given = sock, given

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self) -> list[Heard]:
        heard: list[Heard] = []
        while True:
            try:
                data, sender = self._socket.recvfrom(65535)
            except BlockingIOError:
                return heard
            except ConnectionRefusedError:
                continue
            heard += [(sender, frame) for frame in frames_of(data)]

    def send(self, datagram: bytes, peer: Address | None) -> None:
        to = peer or self._given
        if to is not None:
            with suppress(BlockingIOError, ConnectionRefusedError):  # UDP: lost, as on the air
                self._socket.sendto(datagram, to)

    def close(self) -> None:
        self._socket.close()


class TcpCarrier:
    """A TCP client. A connection that ends is tried again each second."""

    def __init__(self, sock: socket.socket, address: Address) -> None:
        self._address, self._cutter = address, FrameCutter()
        self._retry_at_s = 0.0
        self._up = True
        self._take(sock)

    @classmethod
    def open(cls, host: str, port: int) -> Self:
        """Raises OSError when nobody answers."""
        return cls(socket.create_connection((host, port), CONNECT_WITHIN_S), (host, port))

    def _take(self, sock: socket.socket) -> None:
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = sock

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self) -> list[Heard]:
        if not self._up:
            self._try_again()
        data = b""
        while self._up:
            try:
                chunk = self._socket.recv(65536)
            except BlockingIOError:
                break
            except OSError:
                chunk = b""
            if not chunk:
                self._drop()
            data += chunk
        return [(None, frame) for frame in self._cutter.feed(data)]

    def send(self, datagram: bytes, peer: Address | None) -> None:
        del peer
        if not self._up:
            return
        try:
            self._socket.sendall(datagram)
        except BlockingIOError:
            pass  # the line is full: lost, as on the air
        except OSError:
            self._drop()

    def _drop(self) -> None:
        self._up = False
        self._retry_at_s = time.monotonic() + RECONNECT_S
        self._cutter = FrameCutter()
        self._socket.close()
        self._socket = socket.socket()  # something to wait on meanwhile

    def _try_again(self) -> None:
        if time.monotonic() < self._retry_at_s:
            return
        self._retry_at_s = time.monotonic() + RECONNECT_S
        with suppress(OSError):
            fresh = socket.create_connection(self._address, 0.05)
            self._socket.close()
            self._take(fresh)
            self._up = True

    def close(self) -> None:
        self._socket.close()


class SerialCarrier:
    """A serial line."""

    def __init__(self, device: str, baud: int) -> None:
        self._port = serial.Serial(device, baud, timeout=0, write_timeout=0)
        self._cutter = FrameCutter()

    def fileno(self) -> int:
        return int(self._port.fileno())

    def receive(self) -> list[Heard]:
        data = self._port.read(65536)
        return [(None, frame) for frame in self._cutter.feed(data)]

    def send(self, datagram: bytes, peer: Address | None) -> None:
        del peer
        with suppress(serial.SerialTimeoutException):  # the line is full: lost, as on the air
            self._port.write(datagram)

    def close(self) -> None:
        self._port.close()


def open_carrier(connection: Connection) -> Carrier:
    """Raises InputError in one line when it can't be opened."""
    openers: dict[str, Callable[[str, int], Carrier]] = {
        "udpin": _udp_in,
        "udpout": _udp_out,
        "tcp": TcpCarrier.open,
        "serial": SerialCarrier,
    }
    try:
        return openers[connection.kind](connection.host, connection.port)
    except (OSError, OverflowError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"connection {connection}: {why}; check that it is there, free, and yours to use"
        ) from None


def _udp_in(host: str, port: int) -> UdpCarrier:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.bind((host, port))
    except (OSError, OverflowError):
        sock.close()
        raise
    return UdpCarrier(sock, None)


def _udp_out(host: str, port: int) -> UdpCarrier:
    address = (socket.gethostbyname(host), port)
    return UdpCarrier(socket.socket(socket.AF_INET, socket.SOCK_DGRAM), address)
