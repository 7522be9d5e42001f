"""The vehicle process on real sockets: ready, injection before time begins, repeats, a tidy end."""

import signal
import socket
import subprocess
import sys

import pytest
from rover_process import PATIENCE_S, SCENARIO, RoverProcess, rover_process

from hil.mavlink import CommandAck, Decoder, Encoder, ParamValue, Result


def ask(rover: RoverProcess, *datagrams: bytes) -> list[object]:
    """What the injector's port answers, one datagram for each."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.settimeout(PATIENCE_S)
        answers = []
        for datagram in datagrams:
            sock.sendto(datagram, ("127.0.0.1", rover.injector_port))
            answers += [r.value for r in Decoder().decode(sock.recv(500))]
    return answers


def test_faults_are_acknowledged_before_the_first_reply_of_the_world() -> None:
    injector = Encoder(251, 190)
    with rover_process() as rover:
        assert rover.first_line == "ready\n"
        _gate, size, command = ask(
            rover,
            injector.param_set(2, "SYS_FAILURE_EN", 1.0),
            injector.param_set(2, "SIM_GPS1_STUCK", 2.0),
            injector.inject_failure(2, 4, 2, 0),
        )
        assert isinstance(size, ParamValue)
        assert isinstance(command, CommandAck)
        assert (size.value, command.result) == (2.0, Result.ACCEPTED)
        assert rover.frame()[0].frame_count == 0


def test_an_unanswered_frame_is_repeated_as_it_was() -> None:
    with rover_process() as rover:
        first, again = rover.frame()[0], rover.frame()[0]
        assert first == again
        assert (first.frame_rate_hz, first.frame_count, first.pwm_us) == (50, 0, (0,) * 16)
        assert rover.advance(0.2).frame_count == 10


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_tidily(number: signal.Signals) -> None:
    with rover_process() as rover:
        rover.advance(0.1)
        assert rover.stop(number) == (0, "", "")


def test_a_busy_injector_port_is_an_error_for_people() -> None:
    with rover_process() as rover:
        port = str(rover.injector_port)
        words = ["-m", "sim_vehicles.process", str(SCENARIO), "--sysid", "2"]
        second = subprocess.run(
            [sys.executable, *words, "--injector-port", port],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
    assert (second.returncode, second.stdout) == (2, "")
    assert f"injector port 127.0.0.1:{port} cannot be bound" in second.stderr
    assert len(second.stderr.splitlines()) == 1
