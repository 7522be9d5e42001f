"""Several stations, signatures and kept parameters, with mavutil on real sockets."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lone_vehicle import PATIENCE_S, SYSID, Ports, lone_vehicle
from pymavlink import mavutil

from hil.mavlink import Decoder, Encoder, ParamValue, key_of

SPEED = 3.0


@contextmanager
def station(port: int, sysid: int, key: bytes | None = None) -> Iterator[mavutil.mavfile]:
    """A station that comes by itself."""
    where = f"udpout:127.0.0.1:{port}"
    client = mavutil.mavlink_connection(where, source_system=sysid, source_component=190)
    if key is not None:
        client.setup_signing(key)
    client.mav.heartbeat_send(6, 8, 0, 0, 4)
    yield client
    client.close()


def message(client: mavutil.mavfile, kind: str) -> mavutil.mavlink.MAVLink_message:
    received = client.recv_match(type=kind, blocking=True, timeout=PATIENCE_S)
    assert received is not None, f"no {kind}"
    return received


def parameter(ports: Ports, name: str) -> float:
    """What a station by its own address is told."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.settimeout(PATIENCE_S)
        asked = Encoder(245, 190).param_request_read(SYSID, name)
        sock.sendto(asked, ("127.0.0.1", ports.listen))
        while True:
            for received in Decoder().decode(sock.recv(500)):
                if isinstance(received.value, ParamValue):
                    return received.value.value


def test_guests_come_beside_the_host_and_strangers_get_nothing(tmp_path: Path) -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
        lone_vehicle(tmp_path, speed=SPEED) as ports,
    ):
        stranger.sendto(b"let me in" * 20, ("127.0.0.1", ports.listen))
        with (
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as host,
            station(ports.listen, 245) as first,
            station(ports.listen, 246) as second,
        ):
            host.bind(("127.0.0.1", ports.mavlink))
            host.settimeout(PATIENCE_S)
            first.mav.command_long_send(SYSID, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)
            message(first, "AUTOPILOT_VERSION")
            message(second, "LOCAL_POSITION_NED")
            assert "AUTOPILOT_VERSION" not in second.messages
            assert host.recv(500)
        stranger.setblocking(False)
        try:
            raise AssertionError(stranger.recv(500))
        except BlockingIOError:
            pass


def test_with_a_key_only_signed_stations_are_heard(tmp_path: Path) -> None:
    secret = tmp_path / "pass phrase"
    secret.write_text("not to be guessed\n")
    secret.chmod(0o600)
    options = ("--signing-key", str(secret))
    with (
        lone_vehicle(tmp_path, speed=SPEED, options=options) as ports,
        station(ports.listen, 246) as unsigned,
        station(ports.listen, 247, key_of("a guess")) as wrong,
        station(ports.listen, 245, key_of("not to be guessed")) as right,
    ):
        right.mav.param_set_send(SYSID, 1, b"FS_TIMEOUT", 7.0, 9)
        assert message(right, "PARAM_VALUE").param_value == 7.0
        assert message(right, "HEARTBEAT").get_signed()
        assert unsigned.recv_msg() is None
        assert wrong.recv_msg() is None
        right.mav.param_set_send(SYSID, 1, b"MAV1_OPTIONS", 1.0, 4)
        while message(right, "PARAM_VALUE").param_id != "MAV1_OPTIONS":
            pass
        for stranger in (unsigned, wrong):
            stranger.mav.heartbeat_send(6, 8, 0, 0, 4)
        assert message(unsigned, "HEARTBEAT").get_srcSystem() == SYSID
        assert wrong.recv_msg() is None


def test_changed_parameters_are_kept(tmp_path: Path) -> None:
    options = ("--params", str(tmp_path / "vehicle.parm"))
    with (
        lone_vehicle(tmp_path, speed=SPEED, options=options) as ports,
        station(ports.listen, 245) as client,
    ):
        client.mav.param_set_send(SYSID, 1, b"FS_TIMEOUT", 7.0, 9)
        assert message(client, "PARAM_VALUE").param_value == 7.0
        message(client, "HEARTBEAT")
    with lone_vehicle(tmp_path, speed=SPEED, options=options) as ports:
        assert parameter(ports, "FS_TIMEOUT") == 7.0
