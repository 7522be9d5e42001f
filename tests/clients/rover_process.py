"""A `sim-vehicle` process with a world made of patience: it is answered only when asked to be."""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from free_ports import free_ports

from hil.physics_link import (
    AT_REST_MPS2,
    PhysicsState,
    ServoFrame,
    decode_frame,
    encode_state,
)

SCENARIO = Path(__file__).parents[2] / "scenarios" / "rescue.yaml"
PATIENCE_S = 30.0
ZERO = (0.0, 0.0, 0.0)


class RoverProcess:
    """The process, its physics, and the ports it speaks MAVLink on."""

    def __init__(self) -> None:
        self.physics = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.physics.bind(("127.0.0.1", 0))
        self.physics.settimeout(PATIENCE_S)
        self.mavlink_port, self.injector_port = free_ports(2)
        self.ticks = 0
        ports = {
            "--physics-port": self.physics.getsockname()[1],
            "--mavlink-port": self.mavlink_port,
            "--injector-port": self.injector_port,
        }
        options = [str(word) for pair in ports.items() for word in pair]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sim_vehicles.process", str(SCENARIO), "--sysid", "2", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONWARNINGS": "error"},
        )
        assert self.process.stdout is not None
        self.first_line = self.process.stdout.readline()

    def frame(self) -> tuple[ServoFrame, tuple[str, int]]:
        """The next physics frame, and where it came from."""
        datagram, sender = self.physics.recvfrom(200)
        frame = decode_frame(datagram)
        assert frame is not None
        return frame, sender

    def advance(self, seconds: float) -> ServoFrame:
        """Answer frames at rest for a while; returns the frame after the last answer.

        That one stays unanswered; the vehicle repeats it, and the next call goes on from there.
        """
        frame, sender = self.frame()
        for _ in range(round(seconds * frame.frame_rate_hz)):
            self.ticks += 1
            time_s = self.ticks / frame.frame_rate_hz
            state = PhysicsState(time_s, ZERO, AT_REST_MPS2, ZERO, ZERO, ZERO)
            self.physics.sendto(encode_state(state), sender)
            count = frame.frame_count
            while frame.frame_count == count:  # a repeat may have been on its way
                frame, sender = self.frame()
        return frame

    def stop(self, number: signal.Signals = signal.SIGTERM) -> tuple[int, str, str]:
        """Exit code, and what was left on stdout and stderr."""
        self.process.send_signal(number)
        out, err = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out, err


@contextmanager
def rover_process() -> Iterator[RoverProcess]:
    rover = RoverProcess()
    try:
        yield rover
    finally:
        if rover.process.poll() is None:
            rover.process.kill()
            rover.process.communicate()
        rover.physics.close()
