"""Codecs beside the datagrams of a vehicle: streams, HIL messages, parameter files, signatures."""

import itertools

import numpy as np
from fastcrc.crc16 import mcrf4xx
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import common

from hil.airframe import OMNI_PLUS
from hil.frames import Origin
from hil.hil_link import HilLink
from hil.mavlink import Decoder, Encoder, Heartbeat, Signing
from hil.mavlink.stream import FrameCutter, frames_of
from sim_vehicles.parameter_file import restored, written
from sim_vehicles.parameters import Parameters, rover_parameters

HIL_CONTROLS = common.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS
STATION = Encoder(250, 190)
BEAT = Heartbeat(6, 8, False, 0, 4)


def controls(payload: bytes, signed: bool) -> bytes:
    """HIL_ACTUATOR_CONTROLS with a right checksum, whatever it holds."""
    head = bytes((len(payload), signed, 0, 0, 1, 1)) + HIL_CONTROLS.to_bytes(3, "little")
    extra = bytes([common.mavlink_map[HIL_CONTROLS].crc_extra])
    checksum = mcrf4xx(head + payload + extra).to_bytes(2, "little")
    return b"\xfd" + head + payload + checksum + bytes(13 * signed)


@given(st.lists(st.integers(1, 40), max_size=12), st.lists(st.binary(max_size=5), max_size=4))
def test_a_stream_gives_the_same_frames_however_it_is_cut(
    lengths: list[int], noise: list[bytes]
) -> None:
    sent = [STATION.gcs_heartbeat() for _ in range(3)]
    data = b"".join(
        itertools.chain.from_iterable(itertools.zip_longest(sent, noise, fillvalue=b""))
    )
    cutter, found, at = FrameCutter(), [], 0
    for length in [*lengths, len(data)]:
        found += cutter.feed(data[at : at + length])
        at += length
    assert found == FrameCutter().feed(data)
    if not any(marker in b"".join(noise) for marker in (b"\xfd", b"\xfe")):
        assert [frame for _, frame in found] == sent


@given(st.binary(max_size=300))
def test_any_bytes_are_cut_without_an_exception(data: bytes) -> None:
    frames_of(data)


@given(st.binary(max_size=300), st.binary(min_size=1, max_size=90), st.booleans())
def test_a_boards_controls_are_pulses_whatever_they_hold(
    noise: bytes, payload: bytes, signed: bool
) -> None:
    link = HilLink(Origin(47.0, 8.0, 400.0))
    link.controls(noise)
    for found in link.controls(controls(payload, signed)):
        assert all(p == 0 or 1100 <= p <= 1900 for p in found.pwm_us)


def table() -> Parameters:
    return rover_parameters(1, 250, OMNI_PLUS)


@given(st.dictionaries(st.sampled_from(table().names), st.floats(0.0, 100.0, width=32)))
def test_a_parameter_file_brings_back_what_was_set(values: dict[str, float]) -> None:
    before, after = table(), table()
    for name, value in values.items():
        before.set(name, value)
    assert restored(after, written(before)) == []
    wire = [[np.float32(t[name]) for name in t.names] for t in (before, after)]
    assert wire[0] == wire[1]


@given(st.text(max_size=100))
def test_any_text_as_a_parameter_file_is_complained_about_or_obeyed(text: str) -> None:
    parameters = table()
    restored(parameters, text)
    for name in parameters.names:
        p = parameters.parameter(name)
        assert p.low <= parameters[name] <= p.high


@given(st.binary(min_size=32, max_size=32), st.integers(0, 255), st.integers(0, 2**47))
def test_what_is_signed_is_accepted_once_and_not_if_a_bit_is_wrong(
    key: bytes, link_id: int, now: int
) -> None:
    frame = Encoder(250, 190, Signing(key, link_id, lambda: now)).encode(BEAT)
    decoder = Decoder(Signing(key, 0, lambda: now))
    for at in range(len(frame) - 13, len(frame)):
        assert decoder.decode(frame[:at] + bytes([frame[at] ^ 1]) + frame[at + 1 :]) == []
    assert [len(decoder.decode(frame)) for _ in range(2)] == [1, 0]
