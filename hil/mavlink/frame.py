"""MAVLink frames: datagrams to messages and back. Layouts and seeds come from pymavlink's dialect.

Frames are cut and checked here rather than by pymavlink's stream parser, because a datagram stands
alone: nothing of a bad one may leak into the next.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from struct import Struct
from typing import Any, Literal

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega

from hil.mavlink import condition, missions, piloting, requests, services, telemetry
from hil.mavlink.message import Message
from hil.mavlink.signing import SIGNATURE_BYTES, Signing

MARKER_V1, MARKER_V2 = 0xFE, 0xFD
HEADER_V1, HEADER_V2 = 6, 10  # bytes, with the marker
CHECKSUM = 2
FLAG_SIGNED = 1

Refusal = Literal["unsigned", "forged", "replayed"]


@dataclass(frozen=True, slots=True)
class Other:
    """A valid frame of a message that has no type here; `name` is MAVLink's."""

    name: str


@dataclass(frozen=True, slots=True)
class Received:
    """Who said what."""

    sysid: int
    compid: int
    value: Message | Other


@dataclass(frozen=True, slots=True)
class _Layout:
    name: str
    packing: Struct
    crc_extra: bytes
    message: type[Message] | None


def _messages(*modules: Any) -> dict[int, type[Message]]:
    classes = [c for module in modules for c in vars(module).values() if isinstance(c, type)]
    return {int(c.ID): c for c in classes if issubclass(c, Message) and c is not Message}


_TYPED = _messages(telemetry, condition, requests, piloting, services, missions)
_LAYOUTS = {
    number: _Layout(m.msgname, Struct(m.unpacker.format), bytes([m.crc_extra]), _TYPED.get(number))
    for number, m in ardupilotmega.mavlink_map.items()
}


class Decoder:
    """Bytes to values. It keeps no bytes between datagrams; it counts what it dropped and refused.

    A frame whose checksum is wrong is dropped whether or not it says it is signed: MAVLink's C
    parser accepts such a frame when signing is off, and one has disarmed a rover. With `signing`
    only signed frames count, and unsigned ones while `unsigned_too` says so; without it signatures
    are not looked at.
    """

    def __init__(
        self, signing: Signing | None = None, unsigned_too: Callable[[], bool] = lambda: False
    ) -> None:
        self._signing, self._unsigned_too = signing, unsigned_too
        self.dropped = 0  # stretches of bytes or frames that gave no value
        self.refused: Counter[Refusal] = Counter()  # those of them that signing refused, and why

    def decode(self, datagram: bytes) -> list[Received]:
        """All good frames of one datagram, in order. Never raises."""
        return self._frames(datagram, remember=True)

    def peek(self, datagram: bytes) -> list[Received]:
        """What `decode` would return, which may still be called: no signature is remembered."""
        return self._frames(datagram, remember=False)

    def _frames(self, datagram: bytes, remember: bool) -> list[Received]:
        received = []
        at = 0
        while at < len(datagram):
            end, value = _frame_at(datagram, at, partial(self._admits, remember=remember))
            if value is not None:
                received.append(value)
            else:
                self.dropped += 1
            at = end
        return received

    def _admits(self, frame: bytes, sysid: int, compid: int, remember: bool) -> bool:
        """Whether signing lets a whole frame in, whose checksum is right."""
        signing = self._signing
        if signing is None:
            return True
        if frame[0] != MARKER_V2 or not frame[2] & FLAG_SIGNED:
            if self._unsigned_too():
                return True
            self.refused["unsigned"] += 1
        elif not signing.is_genuine(frame):
            self.refused["forged"] += 1
        elif not signing.is_new(frame, sysid, compid):
            self.refused["replayed"] += 1
        else:
            return not remember or signing.accepts(frame, sysid, compid)
        return False


def _frame_at(
    data: bytes, at: int, admits: Callable[[bytes, int, int], bool]
) -> tuple[int, Received | None]:
    """Where to look for the next frame, and what the one at `at` says if it is good."""
    if data[at] == MARKER_V2:
        header = HEADER_V2
    elif data[at] == MARKER_V1:
        header = HEADER_V1
    else:
        return _next_marker(data, at + 1), None
    if len(data) < at + header + CHECKSUM:
        return len(data), None
    flags = 0
    if header == HEADER_V2:
        flags, sysid, compid = data[at + 2], data[at + 5], data[at + 6]
        number = data[at + 7] | data[at + 8] << 8 | data[at + 9] << 16
    else:
        sysid, compid, number = data[at + 3], data[at + 4], data[at + 5]
    payload_end = at + header + data[at + 1]
    end = payload_end + CHECKSUM + (SIGNATURE_BYTES if flags & FLAG_SIGNED else 0)
    layout = _LAYOUTS.get(number)
    if layout is None or flags & ~FLAG_SIGNED or end > len(data):
        return _next_marker(data, at + 1), None
    checksum = data[payload_end] | data[payload_end + 1] << 8
    if checksum != mcrf4xx(data[at + 1 : payload_end] + layout.crc_extra):
        return _next_marker(data, at + 1), None
    if not admits(data[at:end], sysid, compid):
        return end, None
    value = _value(layout, data[at + header : payload_end])
    return end, None if value is None else Received(sysid, compid, value)


def _next_marker(data: bytes, at: int) -> int:
    places = (data.find(MARKER_V2, at), data.find(MARKER_V1, at))
    return min((p for p in places if p >= 0), default=len(data))


def _value(layout: _Layout, payload: bytes) -> Message | Other | None:
    if layout.message is None:
        return Other(layout.name)
    size = layout.packing.size
    # MAVLink 2 strips trailing zeros; a newer dialect may append fields
    fields = layout.packing.unpack(payload[:size].ljust(size, b"\0"))
    return layout.message.from_wire(*fields)


class Framer:
    """Values to MAVLink 2 frames of one sender, sequence numbers counted; signed if wanted."""

    def __init__(self, sysid: int, compid: int, signing: Signing | None = None) -> None:
        self.sysid, self.compid, self._signing = sysid, compid, signing
        self._sequence = 0

    def encode(self, value: Message) -> bytes:
        """One frame. Raises struct.error or OverflowError for a value its field can't hold."""
        number = int(value.ID)
        layout = _LAYOUTS[number]
        payload = layout.packing.pack(*value.to_wire()).rstrip(b"\0") or b"\0"
        ids = bytes((self.sysid, self.compid)) + number.to_bytes(3, "little")
        flags = FLAG_SIGNED if self._signing else 0
        body = bytes((len(payload), flags, 0, self._sequence)) + ids + payload
        self._sequence = (self._sequence + 1) % 256
        checksum = mcrf4xx(body + layout.crc_extra)
        frame = b"\xfd" + body + checksum.to_bytes(2, "little")
        return self._signing.sign(frame) if self._signing else frame


def crc_extra_of(number: int) -> bytes | None:
    """The seed that a message's checksum ends with; None for a message not known."""
    layout = _LAYOUTS.get(number)
    return None if layout is None else layout.crc_extra


def payload_bytes(number: int) -> int:
    """The whole payload of a message, extensions included. Raises KeyError for one not known."""
    return int(_LAYOUTS[number].packing.size)
