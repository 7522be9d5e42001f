"""Signing against MAVLink's reference library: accepted, refused, replayed."""

from pymavlink.dialects.v20 import ardupilotmega as reference

from hil.mavlink import Decoder, Encoder, Heartbeat, Signing, key_of, ticks
from hil.mavlink.signing import MAX_STREAMS, NEW_STREAM_LAG

KEY = key_of("a pass phrase")
NOW = ticks(1_763_827_200.0)
BEAT = Heartbeat(6, 8, False, 0, 4)


def signing(now: int = NOW, link_id: int = 0, key: bytes = KEY) -> Signing:
    return Signing(key, link_id, lambda: now)


def signed(now: int = NOW, sysid: int = 250, link_id: int = 0, key: bytes = KEY) -> bytes:
    return Encoder(sysid, 190, signing(now, link_id, key)).encode(BEAT)


def test_the_reference_accepts_what_we_sign() -> None:
    theirs = reference.MAVLink(None)
    theirs.signing.secret_key, theirs.signing.timestamp = KEY, NOW - 10
    message = theirs.parse_char(signed())
    assert message.get_signed()


def test_we_accept_what_the_reference_signs() -> None:
    theirs = reference.MAVLink(None, srcSystem=250, srcComponent=190)
    theirs.signing.secret_key, theirs.signing.link_id = KEY, 3
    theirs.signing.timestamp, theirs.signing.sign_outgoing = NOW, True
    frame = reference.MAVLink_heartbeat_message(6, 8, 1, 0, 4, 3).pack(theirs)
    assert [r.value for r in Decoder(signing()).decode(bytes(frame))] == [BEAT]


def test_unsigned_forged_and_wrongly_keyed_frames_are_refused() -> None:
    decoder = Decoder(signing())
    frame = signed()
    forged = frame[:-1] + bytes([frame[-1] ^ 1])
    assert decoder.decode(Encoder(250, 190).encode(BEAT)) == []
    assert decoder.decode(forged) == []
    assert decoder.decode(signed(key=key_of("another"))) == []
    assert decoder.dropped == 3
    assert len(decoder.decode(frame)) == 1


def test_a_replayed_or_older_frame_is_refused() -> None:
    decoder = Decoder(signing())
    frame, later = signed(NOW + 5), signed(NOW + 6)
    assert [len(decoder.decode(f)) for f in (frame, frame, later, frame, later)] == [1, 0, 1, 0, 0]
    assert len(decoder.decode(signed(NOW + 5, link_id=1))) == 1


def test_a_new_stream_may_be_a_minute_late_but_not_more() -> None:
    assert len(Decoder(signing()).decode(signed(NOW - NEW_STREAM_LAG + 1))) == 1
    assert Decoder(signing()).decode(signed(NOW - NEW_STREAM_LAG)) == []


def test_own_stamps_rise_although_the_clock_stands() -> None:
    encoder = Encoder(250, 190, signing())
    decoder = Decoder(signing())
    assert [len(decoder.decode(encoder.encode(BEAT))) for _ in range(3)] == [1, 1, 1]


def test_streams_are_bounded() -> None:
    decoder = Decoder(signing())
    taken = [len(decoder.decode(signed(sysid=k))) for k in range(1, MAX_STREAMS + 3)]
    assert taken == [1] * MAX_STREAMS + [0, 0]


def test_without_a_key_signatures_are_not_looked_at() -> None:
    assert len(Decoder().decode(signed())) == 1
