"""The physics link codec: what goes in comes out, and nothing that arrives can raise."""

from hypothesis import given
from hypothesis import strategies as st

from hil.physics_link import (
    PhysicsState,
    ServoFrame,
    decode_frame,
    decode_state,
    encode_frame,
    encode_state,
)

FINITE = st.floats(allow_nan=False, allow_infinity=False)
VECTORS = st.tuples(FINITE, FINITE, FINITE)
U16 = st.integers(0, 0xFFFF)
PWM = st.sampled_from((16, 32)).flatmap(lambda n: st.tuples(*[U16] * n))
FRAMES = st.builds(ServoFrame, st.integers(1, 0xFFFF), st.integers(0, 0xFFFFFFFF), PWM)
STATES = st.builds(PhysicsState, FINITE, VECTORS, VECTORS, VECTORS, VECTORS, VECTORS)


@given(FRAMES)
def test_frame_round_trip(frame: ServoFrame) -> None:
    assert decode_frame(encode_frame(frame)) == frame


@given(STATES)
def test_state_round_trip(state: PhysicsState) -> None:
    datagram = encode_state(state)
    assert decode_state(datagram) == state
    assert datagram.startswith(b"\n")
    assert datagram.endswith(b"\n")
    assert b" " not in datagram


@given(st.binary(max_size=80))
def test_any_bytes_decode_without_an_exception(datagram: bytes) -> None:
    decode_frame(datagram)
    decode_state(datagram)


@given(STATES, st.data())
def test_truncated_or_flipped_states_never_raise(state: PhysicsState, data: st.DataObject) -> None:
    datagram = bytearray(encode_state(state))
    cut = data.draw(st.integers(0, len(datagram) - 1))
    decode_state(bytes(datagram[:cut]))
    datagram[cut] ^= data.draw(st.integers(1, 255))
    decode_state(bytes(datagram))
