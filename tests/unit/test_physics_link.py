"""The physics link against bytes worked out by hand."""

import json
import struct

import pytest

from hil.physics_link import (
    AT_REST_MPS2,
    PhysicsState,
    ServoFrame,
    decode_frame,
    decode_state,
    encode_frame,
    encode_state,
    pad_channels,
)

ZERO = (0.0, 0.0, 0.0)
STATE = PhysicsState(1.5, ZERO, AT_REST_MPS2, (1.0, 2.0, 0.0), ZERO, (0.0, 0.0, 0.5))


def test_frame_bytes_are_ardupilots() -> None:
    frame = ServoFrame(200, 7, pad_channels((1500, 1900)))
    datagram = encode_frame(frame)
    assert datagram == struct.pack("<HHI16H", 18458, 200, 7, 1500, 1900, *[0] * 14)
    assert len(datagram) == 40


def test_thirty_two_channels() -> None:
    datagram = struct.pack("<HHI32H", 29569, 50, 1, *range(32))
    assert decode_frame(datagram) == ServoFrame(50, 1, tuple(range(32)))


@pytest.mark.parametrize(
    "datagram",
    [
        b"",
        b"x" * 40,
        struct.pack("<HHI16H", 29569, 50, 1, *[0] * 16),
        struct.pack("<HHI16H", 18458, 0, 1, *[0] * 16),
        struct.pack("<HHI16H", 18458, 50, 1, *[0] * 16) + b"\0",
    ],
    ids=["empty", "noise", "wrong magic", "rate zero", "too long"],
)
def test_what_is_no_frame_is_none(datagram: bytes) -> None:
    assert decode_frame(datagram) is None


def test_a_frame_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="3 channels"):
        encode_frame(ServoFrame(200, 7, (1, 2, 3)))


def test_state_text() -> None:
    text = encode_state(STATE).decode()
    assert text.startswith('\n{"timestamp":1.5,"imu":{"gyro":[0.0,0.0,0.0],"accel_body":[0.0,')
    assert '"position":[1.0,2.0,0.0]' in text


@pytest.mark.parametrize("missing", ["timestamp", "imu", "position", "velocity", "attitude"])
def test_every_field_is_required(missing: str) -> None:
    tree = json.loads(encode_state(STATE))
    del tree[missing]
    assert decode_state(json.dumps(tree).encode()) is None


@pytest.mark.parametrize("bad", ["NaN", "Infinity", "1e999", "true", '"1"', "null", "[1]"])
def test_only_finite_numbers_pass(bad: str) -> None:
    datagram = encode_state(STATE).replace(b'"timestamp":1.5', f'"timestamp":{bad}'.encode())
    assert decode_state(datagram) is None


def test_deep_nesting_is_no_crash() -> None:
    assert decode_state(b"[" * 60_000) is None
