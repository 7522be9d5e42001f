"""The physics side of an autopilot, as small as it can be: frames out, states in."""

import socket
from collections.abc import Sequence

from hil.physics_link import PhysicsState, ServoFrame, decode_state, encode_frame, pad_channels

ANSWER_WITHIN_S = 30.0


class FakeVehicle:
    """Holds one set of motor outputs."""

    def __init__(self, port: int, pwm_us: Sequence[int] = (1500,) * 4, rate_hz: int = 50) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.settimeout(ANSWER_WITHIN_S)
        self._pwm_us, self._rate_hz, self._count = pad_channels(pwm_us), rate_hz, 0

    def __enter__(self) -> "FakeVehicle":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def send(self) -> None:
        self._socket.send(encode_frame(ServoFrame(self._rate_hz, self._count, self._pwm_us)))

    def receive(self) -> PhysicsState:
        state = decode_state(self._socket.recv(65536))
        assert state is not None
        self._count += 1
        return state

    def step(self) -> PhysicsState:
        self.send()
        return self.receive()
