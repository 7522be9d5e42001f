"""`--dry-run`: a real socket at the other end gets not one byte, and everything is shown."""

import socket
from contextlib import ExitStack, closing

import pytest

from base_station.autopilots import adapter
from base_station.commands import Arm, Drive, Heartbeat, SetMode, encode
from base_station.field.dry import DryEnd
from hil.airframe import OMNI_PLUS
from hil.carriers import open_carrier
from hil.connection import Connection
from hil.mavlink import COMPONENT_GCS, Encoder
from hil.router import Router


def test_nothing_is_sent_and_all_is_shown() -> None:
    with ExitStack() as stack:
        vehicle = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        vehicle.bind(("127.0.0.1", 0))
        to = Connection("udpout", "127.0.0.1", vehicle.getsockname()[1])
        wet = stack.enter_context(closing(Router(open_carrier(to)))).end(3)
        shown: list[str] = []
        dry = DryEnd(wet, "rover_3", shown.append)
        encoder, autopilot = Encoder(250, COMPONENT_GCS), adapter("testbed", OMNI_PLUS)
        commands = (Heartbeat(3), Arm(3), SetMode(3, 15), Drive(3, 1.0, 0.3, -0.1, None))
        for command in commands:
            dry.send(encode(command, encoder, autopilot))
        vehicle.setblocking(False)
        with pytest.raises(BlockingIOError):
            vehicle.recv(1000)
        wet.send(encode(Arm(3), encoder, autopilot))  # the same way, not dry, does get there
        vehicle.settimeout(5.0)
        assert vehicle.recv(1000)
    assert len(shown) == len(commands)
    assert all(text.startswith("rover_3 <- ") for text in shown)
    assert "SetMode" in shown[2] or "176" in shown[2]
    assert "0.3" in shown[3]
