"""Codecs as round trips, and frames that are broken in every way: nothing raises, nothing leaks."""

import math

from fastcrc.crc16 import mcrf4xx
from hypothesis import assume, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega

from hil.mavlink import Decoder, Encoder, LocalPosition, MessageId, Other, Received

IDS = st.sampled_from(sorted(int(m) for m in MessageId))
BYTE = st.integers(0, 255)
FINITE = st.floats(width=32, allow_nan=False, allow_infinity=False)
VECTORS = st.tuples(FINITE, FINITE, FINITE)
GOOD = Encoder(1, 1).encode(LocalPosition(1.0, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0)))


def frame(number: int, payload: bytes, flags: int = 0, signature: bytes = b"") -> bytes:
    """A MAVLink 2 frame with a correct checksum, whatever its payload."""
    head = bytes((len(payload), flags, 0, 0, 1, 1)) + number.to_bytes(3, "little")
    extra = bytes([ardupilotmega.mavlink_map[number].crc_extra])
    checksum = mcrf4xx(head + payload + extra)
    return b"\xfd" + head + payload + checksum.to_bytes(2, "little") + signature


@st.composite
def frames(draw: st.DrawFn) -> bytes:
    number = draw(IDS)
    size = ardupilotmega.mavlink_map[number].unpacker.size
    return frame(number, draw(st.binary(min_size=1, max_size=min(255, size + 3))))


@given(frames())
def test_what_we_understand_survives_the_way_back(datagram: bytes) -> None:
    """Any valid payload of any typed message; text and headings may be normalised once."""
    received = Decoder().decode(datagram)
    assume(received)
    first = received[0].value
    assert not isinstance(first, Other)
    assume(getattr(first, "time_s", 0.0) < 1e9)  # float64 holds no more microseconds
    (second,) = Decoder().decode(Encoder(1, 1).encode(first))
    assert not isinstance(second.value, Other)
    (third,) = Decoder().decode(Encoder(1, 1).encode(second.value))
    assert repr(third) == repr(second)  # repr: a command's NaN params equal nothing


@given(frames())
def test_no_typed_value_but_a_command_or_mission_item_holds_a_nan(datagram: bytes) -> None:
    for received in Decoder().decode(datagram):
        if not type(received.value).__name__.startswith(("Command", "MissionItem")):
            assert "nan" not in repr(received.value).replace("name", "")
            assert "inf" not in repr(received.value)


@given(st.integers(0, 2**32 - 1), VECTORS, VECTORS)
def test_local_position_is_exact(
    ms: int, position: tuple[float, float, float], velocity: tuple[float, float, float]
) -> None:
    value = LocalPosition(ms / 1e3, position, velocity)
    assert Decoder().decode(Encoder(3, 1).encode(value)) == [Received(3, 1, value)]


@given(st.integers(0, 5), st.sampled_from([math.nan, math.inf, -math.inf]))
def test_a_position_that_is_no_number_is_dropped(field: int, bad: float) -> None:
    numbers = [0.0] * 6
    numbers[field] = bad
    message = LocalPosition(0.0, (*numbers[:3],), (*numbers[3:],))  # type: ignore[arg-type]
    decoder = Decoder()
    assert decoder.decode(Encoder(1, 1).encode(message)) == []
    assert decoder.dropped == 1


@given(st.binary(max_size=600))
def test_random_bytes_never_raise(datagram: bytes) -> None:
    Decoder().decode(datagram)


@given(st.lists(st.sampled_from([0xFD, 0xFE, 0, 1, 9, 32, 255]), max_size=300).map(bytes))
def test_bytes_that_look_like_frames_never_raise(datagram: bytes) -> None:
    Decoder().decode(datagram)


@given(st.integers(0, len(GOOD) - 1))
def test_truncated_frames_give_nothing_and_leave_nothing_behind(length: int) -> None:
    decoder = Decoder()
    assert decoder.decode(GOOD[:length]) == []
    assert decoder.decode(GOOD[length:]) == [] or length == 0
    assert len(decoder.decode(GOOD)) == 1


@given(frames(), st.data())
def test_one_wrong_byte_and_the_frame_is_gone(datagram: bytes, data: st.DataObject) -> None:
    """One byte of header, payload or checksum: a 16-bit CRC finds all errors of 8 bits."""
    at = data.draw(st.integers(1, len(datagram) - 1))
    wrong = datagram[at] ^ data.draw(st.integers(1, 255))
    broken = datagram[:at] + bytes([wrong]) + datagram[at + 1 :]
    whole = [r for r in Decoder().decode(datagram) if not isinstance(r.value, Other)]
    assume(at not in (2, 7, 8, 9))  # flags and id change how the rest is read
    assume(at != 1)
    for received in Decoder().decode(broken):
        assert received not in whole


@given(frames(), st.binary(min_size=13, max_size=13), st.integers(1, 65535))
def test_the_signed_flag_does_not_excuse_a_wrong_checksum(
    datagram: bytes, signature: bytes, error: int
) -> None:
    number = int.from_bytes(datagram[7:10], "little")
    signed = frame(number, datagram[10:-2], flags=1, signature=signature)
    at = len(signed) - 15
    checksum = int.from_bytes(signed[at : at + 2], "little") ^ error
    broken = signed[:at] + checksum.to_bytes(2, "little") + signature
    assert [r for r in Decoder().decode(broken) if r.sysid == 1 and r.compid == 1] == []
    assert len(Decoder().decode(signed)) == len(Decoder().decode(datagram))


@given(st.binary(max_size=40))
def test_a_good_frame_behind_garbage_is_found(garbage: bytes) -> None:
    assume(0xFD not in garbage)
    assume(0xFE not in garbage)
    assert [r.sysid for r in Decoder().decode(garbage + GOOD + garbage)] == [1]


@given(st.lists(BYTE, min_size=1, max_size=3))
def test_unknown_incompatibility_flags_are_refused(flags: list[int]) -> None:
    for flag in flags:
        if flag & ~1:
            assert Decoder().decode(frame(0, b"\1" * 9, flags=flag)) == []
