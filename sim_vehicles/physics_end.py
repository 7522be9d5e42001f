"""The vehicle's end of the physics link: one frame out, one state back (pure).

Source: ArduPilot's JSON simulator interface. A frame without a reply is repeated as it was.
"""

from collections.abc import Iterable, Sequence

from hil.errors import ProcessDiedError
from hil.physics_link import PhysicsState, ServoFrame, decode_state, encode_frame, pad_channels

RESTARTED_S = 1.0  # physics time going back by more than this is no late duplicate


class PhysicsEnd:
    """Counts frames from 0, and takes each reply once."""

    def __init__(self, frame_rate_hz: int) -> None:
        self._rate_hz = frame_rate_hz
        self._count = 0
        self._time_s: float | None = None

    def frame(self, pwm_us: Sequence[int]) -> bytes:
        """The frame that is due, with 16 outputs in us."""
        return encode_frame(ServoFrame(self._rate_hz, self._count, pad_channels(pwm_us)))

    def accept(self, datagrams: Iterable[bytes]) -> PhysicsState | None:
        """The reply to the frame, if it is there; late duplicates and garbage are dropped.

        Raises ProcessDiedError when physics time starts again: an autopilot can't live twice.
        """
        for state in map(decode_state, datagrams):
            if state is None:
                continue
            if self._time_s is None or state.time_s > self._time_s:
                self._time_s = state.time_s
                self._count += 1
                return state
            if state.time_s < self._time_s - RESTARTED_S:
                raise ProcessDiedError(
                    f"physics time went back from {self._time_s:.2f} to {state.time_s:.2f} s; "
                    "the world was restarted, so restart the vehicle too"
                )
        return None
