"""Carriers and the router over real sockets and a real terminal line."""

import os
import pty
import select
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing

import pytest
from free_ports import free_ports
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.carriers import UdpCarrier, open_carrier
from hil.connection import Connection, parse_connection
from hil.errors import InputError
from hil.link import PEER_FORGOTTEN_S
from hil.mavlink import COMPONENT_AUTOPILOT, COMPONENT_GCS, Attitude, Encoder, Heartbeat
from hil.mavlink.stream import FrameCutter, message_id
from hil.router import Router

HOST = "127.0.0.1"


def attitude(sysid: int, time_s: float = 1.0) -> bytes:
    vehicle = Encoder(sysid, COMPONENT_AUTOPILOT)
    return vehicle.encode(Attitude(time_s, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0))


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def udp(stack: ExitStack) -> socket.socket:
    sock = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    sock.bind((HOST, 0))
    sock.settimeout(5.0)
    return sock


def routed(stack: ExitStack, connection: Connection) -> Router:
    return stack.enter_context(closing(Router(open_carrier(connection))))


def bound(stack: ExitStack) -> tuple[Router, int]:
    (port,) = free_ports(1)
    return routed(stack, parse_connection(f"udpin:{HOST}:{port}")), port


def heard(router: Router, sysid: int) -> list[bytes]:
    select.select([router], [], [], 5.0)
    return router.take(sysid)


def test_three_vehicles_behind_one_router_are_told_apart(stack: ExitStack) -> None:
    router, port = bound(stack)
    ends = {sysid: router.end(sysid) for sysid in (1, 2, 3)}
    proxy = udp(stack)
    proxy.sendto(attitude(1) + attitude(3) + attitude(77) + attitude(1, 2.0), (HOST, port))
    assert heard(router, 1) == [attitude(1), attitude(1, 2.0)]
    assert ends[2].receive() == []
    assert ends[3].receive() == [attitude(3)]
    ends[3].send(Encoder(250, COMPONENT_GCS).arm(3))
    assert proxy.recv(1000) == Encoder(250, COMPONENT_GCS).arm(3)


def test_vehicles_that_come_to_one_port_by_themselves_get_their_own_answers(
    stack: ExitStack,
) -> None:
    router, port = bound(stack)
    ends = {sysid: router.end(sysid) for sysid in (1, 2)}
    vehicles = {sysid: udp(stack) for sysid in ends}
    for sysid, vehicle in vehicles.items():
        vehicle.sendto(attitude(sysid), (HOST, port))
        while not ends[sysid].receive():
            select.select([router], [], [], 5.0)
    order = Encoder(250, COMPONENT_GCS).arm(2)
    beat = Encoder(250, COMPONENT_GCS).gcs_heartbeat()
    ends[2].send(order)
    ends[1].send(beat)
    assert [vehicles[2].recv(1000) for _ in range(2)] == [order, beat]
    assert vehicles[1].recv(1000) == beat


def test_nobody_takes_the_place_of_a_vehicle_that_speaks(stack: ExitStack) -> None:
    clock = [0.0]
    sock = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    sock.bind((HOST, 0))
    router = Router(UdpCarrier(sock, None), lambda: clock[0])
    end, others = router.end(1), []
    end.guard(lambda frame: frame != attitude(1, 66.0), others.append)
    vehicle, thief = udp(stack), udp(stack)
    address = sock.getsockname()
    order = Encoder(250, COMPONENT_GCS).arm(1)
    thief.sendto(attitude(1, 66.0), address)  # not welcome: it is not the vehicle's
    vehicle.sendto(attitude(1), address)
    assert until_heard(router, 1) == [attitude(1)]
    thief.sendto(attitude(1, 5.0) + Encoder(250, 190).gcs_heartbeat(), address)
    vehicle.sendto(attitude(1, 2.0), address)
    assert until_heard(router, 1) == [attitude(1, 2.0)]
    assert others == [250]
    end.send(order)
    assert vehicle.recv(1000) == order
    clock[0] = PEER_FORGOTTEN_S + 0.1
    thief.sendto(attitude(1, 5.0), address)  # the vehicle, started again, has another port
    assert until_heard(router, 1) == [attitude(1, 5.0)]
    end.send(order)
    assert thief.recv(1000) == order


def test_a_stranger_who_sends_first_is_told_nothing(stack: ExitStack) -> None:
    router, port = bound(stack)
    end = router.end(1)
    end.guard(lambda frame: message_id(frame) == Heartbeat.ID, lambda _sysid: None)
    stranger, vehicle = udp(stack), udp(stack)
    beat = Encoder(1, COMPONENT_AUTOPILOT).gcs_heartbeat()
    stranger.sendto(attitude(77) + attitude(1), (HOST, port))
    vehicle.sendto(attitude(1) + beat, (HOST, port))
    assert heard(router, 1) == [beat]
    end.send(Encoder(250, COMPONENT_GCS).gcs_heartbeat())
    end.send(Encoder(250, COMPONENT_GCS).arm(1))
    assert len([vehicle.recv(1000) for _ in range(2)]) == 2
    stranger.setblocking(False)
    with pytest.raises(BlockingIOError):
        stranger.recv(1000)


def test_before_a_vehicle_is_known_nobody_is_spoken_to(stack: ExitStack) -> None:
    router, port = bound(stack)
    end = router.end(1)
    stranger = udp(stack)
    stranger.sendto(attitude(77), (HOST, port))
    assert heard(router, 1) == []
    end.send(Encoder(250, COMPONENT_GCS).arm(1))
    end.send(Encoder(250, COMPONENT_GCS).gcs_heartbeat())
    stranger.setblocking(False)
    with pytest.raises(BlockingIOError):
        stranger.recv(1000)


def until_heard(router: Router, sysid: int) -> list[bytes]:
    """What the two senders before have sent has all arrived then: loopback keeps their order."""
    while not (frames := heard(router, sysid)):
        pass
    return frames


def test_a_client_speaks_first(stack: ExitStack) -> None:
    vehicle = udp(stack)
    router = routed(stack, parse_connection(f"udpout:{HOST}:{vehicle.getsockname()[1]}"))
    end = router.end(1)
    end.send(Encoder(250, COMPONENT_GCS).gcs_heartbeat())
    _, station = vehicle.recvfrom(1000)
    vehicle.sendto(attitude(1), station)
    assert heard(router, 1) == [attitude(1)]


def test_tcp_cuts_frames_out_of_the_stream_and_comes_back_after_the_end(stack: ExitStack) -> None:
    server = stack.enter_context(socket.create_server((HOST, 0)))
    router = routed(stack, parse_connection(f"tcp:{HOST}:{server.getsockname()[1]}"))
    end = router.end(1)
    peer, _ = server.accept()
    data = attitude(1) + b"noise\xfd" + attitude(1, 2.0)
    peer.sendall(data[:20])
    assert heard(router, 1) == []
    peer.sendall(data[20:])
    assert heard(router, 1) == [attitude(1), attitude(1, 2.0)]
    peer.close()
    server.settimeout(0.2)
    again = until(server, lambda: end.receive())
    again.sendall(attitude(1, 3.0))
    assert heard(router, 1) == [attitude(1, 3.0)]
    again.close()


def until(server: socket.socket, poll: Callable[[], object]) -> socket.socket:
    """The next connection; `poll` is called while waiting for it."""
    while True:
        poll()
        try:
            return server.accept()[0]
        except TimeoutError:
            continue


def test_a_serial_line(stack: ExitStack) -> None:
    ours, theirs = pty.openpty()
    stack.callback(os.close, ours)
    stack.callback(os.close, theirs)
    router = routed(stack, Connection("serial", os.ttyname(theirs), 57600))
    end = router.end(1)
    os.write(ours, attitude(1))
    assert heard(router, 1) == [attitude(1)]
    end.send(Encoder(250, COMPONENT_GCS).arm(1))
    assert os.read(ours, 1000) == Encoder(250, COMPONENT_GCS).arm(1)


@pytest.mark.parametrize("text", ["tcp:127.0.0.1:1", "serial:/dev/no-such-device,57600"])
def test_what_cannot_be_opened_is_one_line(text: str) -> None:
    with pytest.raises(InputError, match=f"connection {text}: ") as error:
        open_carrier(parse_connection(text))
    assert "\n" not in str(error.value)


@settings(deadline=None)
@given(st.lists(st.one_of(st.just(attitude(1)), st.binary(max_size=6)), max_size=12), st.data())
def test_frames_come_out_however_the_stream_is_chopped(
    parts: list[bytes], data: st.DataObject
) -> None:
    stream = b"".join(parts) + attitude(2) * 20  # what looked like a frame has come to its end
    cutter, found, at = FrameCutter(), [], 0
    while at < len(stream):
        step = data.draw(st.integers(1, 300))
        found += cutter.feed(stream[at : at + step])
        at += step
    assert [f for s, f in found if s == 1] == [p for p in parts if p == attitude(1)]
    assert all(message_id(frame) == 30 for _, frame in found)
