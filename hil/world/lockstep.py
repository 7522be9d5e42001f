"""Lockstep: whose frame is in, who is waited for, what is answered (pure; time is passed in).

A vehicle sends a frame and blocks until it is answered. A frame holds for `physics_hz /
frame_rate` steps; then the vehicle gets the state and owes the next frame. The world steps only
when nobody owes one. A frame is never answered twice, except when the answer seems lost.
"""

from dataclasses import dataclass
from enum import Enum

from hil.physics_link import ServoFrame

RESEND_AFTER_S = 0.5
SILENT_AFTER_S = 2.0


class Presence(Enum):
    """ABSENT: never heard of. JOINED: in lockstep. LOST: fell silent, has no power."""

    ABSENT = "absent"
    JOINED = "joined"
    LOST = "lost"


@dataclass
class _Seat:
    """What is known of one vehicle. `owes` means that the world waits for its frame."""

    presence: Presence = Presence.ABSENT
    frame: ServoFrame | None = None
    owes: bool = True
    answer_due: int = 0  # step at which the held frame is answered
    heard_s: float = 0.0  # wall time of its last datagram, or of our answer to it
    reply: bytes = b""
    reply_left_s: float = 0.0


class Lockstep:
    """The state of all physics links. Steps count from 0; `now_s` is any monotonic wall time."""

    def __init__(self, sysids: tuple[int, ...], physics_hz: int) -> None:
        self._physics_hz = physics_hz
        self._seats = {sysid: _Seat() for sysid in sysids}

    def receive(self, sysid: int, frame: ServoFrame, step: int, now_s: float) -> bytes | None:
        """Take a frame; returns the cached reply when that has to go out again."""
        seat = self._seats[sysid]
        seat.heard_s = now_s
        if self._is_new(seat, frame):
            seat.presence = Presence.JOINED
            seat.frame, seat.owes = frame, False
            seat.answer_due = step + self._period_steps(frame)
            return None
        lost = seat.owes and seat.frame is not None and seat.frame.frame_count == frame.frame_count
        if not lost or now_s - seat.reply_left_s <= RESEND_AFTER_S:
            return None
        seat.reply_left_s = now_s
        return seat.reply

    def outputs(self) -> dict[int, tuple[int, ...]]:
        """PWM (us) now in force; a vehicle that is absent or lost has none."""
        return {
            sysid: seat.frame.pwm_us
            for sysid, seat in self._seats.items()
            if seat.presence is Presence.JOINED and seat.frame is not None
        }

    def absent(self) -> tuple[int, ...]:
        """Who has never sent a frame."""
        return self._with(Presence.ABSENT)

    def waiting_for(self) -> tuple[int, ...]:
        """Who owes a frame: the world must not step before these are in."""
        return tuple(s for s in self._with(Presence.JOINED) if self._seats[s].owes)

    def may_step(self) -> bool:
        """All frames are in, and there is at least one vehicle to step for."""
        return bool(self._with(Presence.JOINED)) and not self.waiting_for()

    def next_answer(self) -> int:
        """The step up to which the world can go without an answer. Needs `may_step()`."""
        return min(self._seats[s].answer_due for s in self._with(Presence.JOINED))

    def answers_due(self, step: int) -> tuple[int, ...]:
        """Whose held frame ends at `step`."""
        return tuple(
            sysid
            for sysid, seat in self._seats.items()
            if seat.presence is Presence.JOINED and not seat.owes and seat.answer_due <= step
        )

    def answered(self, sysid: int, reply: bytes, now_s: float) -> None:
        """The reply has left; the vehicle owes its next frame."""
        seat = self._seats[sysid]
        seat.owes, seat.reply, seat.reply_left_s, seat.heard_s = True, reply, now_s, now_s

    def silent(self, now_s: float) -> tuple[int, ...]:
        """Who owes a frame and has sent nothing for two seconds of wall time."""
        return tuple(
            s for s in self.waiting_for() if now_s - self._seats[s].heard_s > SILENT_AFTER_S
        )

    def lose(self, sysid: int) -> None:
        """Go on without a vehicle: its body stays, without power, until a new frame comes."""
        self._seats[sysid].presence = Presence.LOST

    def _with(self, presence: Presence) -> tuple[int, ...]:
        return tuple(s for s, seat in self._seats.items() if seat.presence is presence)

    def _period_steps(self, frame: ServoFrame) -> int:
        """Steps a frame holds: its rate when that divides ours, else each frame is one step."""
        whole, rest = divmod(self._physics_hz, frame.frame_rate_hz)
        return whole if whole and not rest else 1

    @staticmethod
    def _is_new(seat: _Seat, frame: ServoFrame) -> bool:
        """Whether a frame goes on or rejoins; repeats and late duplicates do neither."""
        if seat.frame is None:
            return True
        last = seat.frame.frame_count
        if frame.frame_count == 0:
            return last != 0
        return frame.frame_count > last and seat.owes
