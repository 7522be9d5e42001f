"""`base-station` on its way out: the fleet stands, or has no power, before the process is gone."""

import os
import pty
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from free_ports import free_ports

from hil.lifeline import dying_with_parent
from hil.mavlink import (
    AUTOPILOT_ARDUPILOT,
    COMPONENT_AUTOPILOT,
    TYPE_ROVER,
    Command,
    CommandLong,
    Decoder,
    Encoder,
    Heartbeat,
    RoverMode,
)
from hil.scenario import StationView

PATIENCE_S = 60.0


class Vehicles:
    """Three that say that they are there, and hear what they are told."""

    def __init__(self, stack: ExitStack, ports: Sequence[int]) -> None:
        self._sockets = []
        for sysid, port in enumerate(ports, start=1):
            sock = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            sock.settimeout(PATIENCE_S)
            sock.connect(("127.0.0.1", port))
            beat = Heartbeat(TYPE_ROVER, AUTOPILOT_ARDUPILOT, True, int(RoverMode.GUIDED), 4)
            sock.send(Encoder(sysid, COMPONENT_AUTOPILOT).encode(beat))
            sock.recv(1000)  # a heartbeat: the station has heard this one
            self._sockets.append(sock)

    def told(self, command: int) -> list[tuple[float, ...]]:
        """The first two parameters of that command, as each vehicle hears it first."""
        return [self._told(sock, command) for sock in self._sockets]

    def _told(self, sock: socket.socket, command: int) -> tuple[float, ...]:
        while True:
            for message in Decoder().decode(sock.recv(1000)):
                match message.value:
                    case CommandLong(command=number, params=params) if number == command:
                        return params[:2]


@pytest.fixture
def station(
    rescue_view: StationView, tmp_path: Path
) -> Iterator[tuple[subprocess.Popen[bytes], Vehicles, int]]:
    """The process, its vehicles, and our end of the terminal that it was started from."""
    with ExitStack() as stack:
        ports = free_ports(3)
        fleet = tuple(
            m.model_copy(update={"mavlink_port": p})
            for m, p in zip(rescue_view.fleet, ports, strict=True)
        )
        path = tmp_path / "view.json"
        path.write_text(rescue_view.model_copy(update={"fleet": fleet}).model_dump_json())
        ours, theirs = pty.openpty()
        stack.callback(lambda: _close(ours))
        argv = (sys.executable, "-m", "base_station.process", str(path), "--out", str(tmp_path))
        process = subprocess.Popen(
            (*argv, "--machine"),
            stdin=theirs,
            stdout=subprocess.PIPE,
            preexec_fn=dying_with_parent(),
        )
        stack.enter_context(process)
        stack.callback(process.kill)
        os.close(theirs)
        assert process.stdout is not None
        assert b"ready" in process.stdout.readline()
        yield process, Vehicles(stack, ports), ours


def _close(fd: int) -> None:
    with suppress(OSError):  # a test has closed it
        os.close(fd)


Act = Callable[[subprocess.Popen[bytes], int], object]
HOLD = (Command.DO_SET_MODE, (1.0, float(RoverMode.HOLD)))
DISARM = (Command.COMPONENT_ARM_DISARM, (0.0, 21196.0))
ENDS: dict[str, tuple[Act, tuple[int, tuple[float, ...]]]] = {
    "terminated": (lambda p, _: p.send_signal(signal.SIGTERM), HOLD),
    "terminal hangs up": (lambda p, _: p.send_signal(signal.SIGHUP), HOLD),
    "emergency signal": (lambda p, _: p.send_signal(signal.SIGUSR1), DISARM),
    "space bar": (lambda _, terminal: os.write(terminal, b" "), DISARM),
    "terminal gone": (lambda _, terminal: os.close(terminal), HOLD),
}


@pytest.mark.parametrize(("act", "expected"), ENDS.values(), ids=ENDS.keys())
def test_the_fleet_is_stopped_first(
    act: Act,
    expected: tuple[int, tuple[float, ...]],
    station: tuple[subprocess.Popen[bytes], Vehicles, int],
) -> None:
    process, vehicles, terminal = station
    act(process, terminal)
    command, params = expected
    assert vehicles.told(command) == [params] * 3
    assert process.wait(PATIENCE_S) == 0
