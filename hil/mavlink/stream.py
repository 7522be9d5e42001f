"""Frames out of a stream of bytes, as a serial line or TCP carries them (pure)."""

from fastcrc.crc16 import mcrf4xx

from hil.mavlink.frame import (
    CHECKSUM,
    FLAG_SIGNED,
    HEADER_V1,
    HEADER_V2,
    MARKER_V1,
    MARKER_V2,
    crc_extra_of,
)
from hil.mavlink.signing import SIGNATURE_BYTES

Frame = tuple[int, bytes]  # system id of the sender, the whole frame


class FrameCutter:
    """Keeps what is not whole yet. What is no frame, or fails its checksum, is passed over."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that are whole with `data`, in order. Never raises."""
        buffer, frames, at = self._rest + data, [], 0
        while True:
            at = _next_marker(buffer, at)
            if not _may_begin(buffer, at):
                at += 1
                continue
            end = _end_of(buffer, at)
            if end is None or end > len(buffer):
                break
            frame = buffer[at:end]
            if not _is_sound(frame):
                at += 1
                continue
            frames.append((frame[5] if frame[0] == MARKER_V2 else frame[3], frame))
            at = end
        self._rest = buffer[at:]
        return frames


def frames_of(datagram: bytes) -> list[Frame]:
    """The frames of one datagram, which stands alone."""
    return FrameCutter().feed(datagram)


def message_id(frame: bytes) -> int:
    """Of a frame whose header is whole."""
    if frame[0] == MARKER_V2:
        return int.from_bytes(frame[7:10], "little")
    return frame[5]


def _next_marker(data: bytes, at: int) -> int:
    places = (data.find(MARKER_V2, at), data.find(MARKER_V1, at))
    return min((p for p in places if p >= 0), default=len(data))


def _may_begin(data: bytes, at: int) -> bool:
    """Whether the header at `at`, as far as it is there, is one: noise must not hold up frames."""
    header = data[at : at + HEADER_V2]
    if header[:1] == bytes((MARKER_V1,)):
        return len(header) < HEADER_V1 or crc_extra_of(message_id(header)) is not None
    if len(header) > 2 and header[2] & ~FLAG_SIGNED:
        return False
    return len(header) < HEADER_V2 or crc_extra_of(message_id(header)) is not None


def _end_of(data: bytes, at: int) -> int | None:
    """Where the frame at `at` ends; None while that is not known."""
    if len(data) < at + 3:
        return None
    if data[at] == MARKER_V1:
        return at + HEADER_V1 + data[at + 1] + CHECKSUM
    signature = SIGNATURE_BYTES if data[at + 2] & FLAG_SIGNED else 0
    return at + HEADER_V2 + data[at + 1] + CHECKSUM + signature


def _is_sound(frame: bytes) -> bool:
    header = HEADER_V2 if frame[0] == MARKER_V2 else HEADER_V1
    extra = crc_extra_of(message_id(frame))
    payload_end = header + frame[1]
    if extra is None:
        return False
    checksum = int.from_bytes(frame[payload_end : payload_end + CHECKSUM], "little")
    return checksum == mcrf4xx(frame[1:payload_end] + extra)
