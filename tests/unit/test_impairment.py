"""The radio: loss, delay, jitter, doubles, disorder and garble, each way, the same each time."""

import math
import select
from collections.abc import Callable
from contextlib import closing

import pytest
from vehicle_world import scenario

from hil.impairment import HELD_BACK_S, ImpairedLink, impaired
from hil.link import MemoryLink, UdpLink
from hil.mavlink import Decoder, Encoder
from hil.scenario import Radio, Scenario, station_view

COUNT = 2000


def passed(*radios: Radio, seed: int = 1, inbound: bool = False) -> list[tuple[float, int]]:
    """When which of `COUNT` datagrams came through, one sent each 10 ms."""
    ours, theirs = MemoryLink.pair()
    now_s = [0.0]
    link = ImpairedLink(ours, radios, (seed,), lambda: now_s[0])
    send: Callable[[bytes], None] = theirs.send if inbound else link.send
    arrived = []
    for tick in range(COUNT + 200):
        now_s[0] = tick * 0.01
        if tick < COUNT:
            send(str(tick).encode())
        received = link.receive()
        came = received if inbound else theirs.receive()
        arrived += [(now_s[0], int(datagram)) for datagram in came]
    return arrived


BOTH_WAYS = pytest.mark.parametrize("inbound", [False, True])


def test_a_perfect_radio_is_the_link_itself() -> None:
    ours, _ = MemoryLink.pair()
    assert impaired(ours, scenario(), 1, lambda: 0.0) is ours


@BOTH_WAYS
def test_loss(inbound: bool) -> None:
    arrived = [number for _, number in passed(Radio(loss=0.2), inbound=inbound)]
    assert len(arrived) == pytest.approx(0.8 * COUNT, rel=0.05)
    assert arrived == sorted(set(arrived))


@BOTH_WAYS
def test_delay(inbound: bool) -> None:
    arrived = passed(Radio(delay_s=0.3), inbound=inbound)
    assert [n for _, n in arrived] == list(range(COUNT))
    assert all(t == pytest.approx(n * 0.01 + 0.3) for t, n in arrived)


@BOTH_WAYS
def test_jitter_keeps_the_order(inbound: bool) -> None:
    arrived = passed(Radio(jitter_s=0.1), inbound=inbound)
    assert [n for _, n in arrived] == list(range(COUNT))
    lags = [t - n * 0.01 for t, n in arrived]
    assert min(lags) < 0.08
    assert 0.09 < max(lags) <= 0.11


@BOTH_WAYS
def test_duplicates_come_late(inbound: bool) -> None:
    arrived = passed(Radio(duplication=0.1), inbound=inbound)
    again = [(t, n) for i, (t, n) in enumerate(arrived) if n in {m for _, m in arrived[:i]}]
    assert len(again) == pytest.approx(0.1 * COUNT, rel=0.2)
    assert all(t == pytest.approx(n * 0.01 + HELD_BACK_S) for t, n in again)


@BOTH_WAYS
def test_some_are_overtaken(inbound: bool) -> None:
    numbers = [n for _, n in passed(Radio(reordering=0.1), inbound=inbound)]
    assert sorted(numbers) == list(range(COUNT))
    late = [n for i, n in enumerate(numbers) if i and n < max(numbers[:i])]
    assert len(late) == pytest.approx(0.1 * COUNT, rel=0.2)


def test_the_same_seed_is_the_same_radio() -> None:
    radio = Radio(loss=0.1, delay_s=0.1, jitter_s=0.1, duplication=0.1, reordering=0.1)
    assert passed(radio) == passed(radio)
    assert passed(radio) != passed(radio, seed=2)
    assert passed(radio) != passed(radio, inbound=True)


def test_what_is_lost_does_not_move_the_draws() -> None:
    """Doubling more changes nothing of what is lost."""
    lossy, worse = Radio(loss=0.2), Radio(loss=0.2, duplication=0.3)
    assert {n for _, n in passed(lossy)} == {n for _, n in passed(worse)}


def test_a_vehicle_may_have_a_radio_of_its_own_and_the_station_is_told_of_none() -> None:
    tree = scenario(radio={"loss": 0.5}).model_dump()
    tree["fleet"][0]["radio"] = {"delay_s": 1.0}
    own = Scenario.model_validate(tree)
    ours, theirs = MemoryLink.pair()
    link = impaired(ours, own, 1, lambda: 0.0)
    for _ in range(100):
        link.send(b"x")
    assert theirs.receive() == []
    view = station_view(own, 14550, 0).model_dump_json()
    assert not any(word in view for word in ("radio", "loss", "terrain", "plant"))


def test_a_vehicle_may_have_a_perfect_radio_among_bad_ones() -> None:
    tree = scenario(radio={"loss": 0.5}).model_dump()
    tree["fleet"][0]["radio"] = []
    ours, _ = MemoryLink.pair()
    assert impaired(ours, Scenario.model_validate(tree), 1, lambda: 0.0) is ours


@BOTH_WAYS
def test_a_black_out_begins_and_ends(inbound: bool) -> None:
    """From 5 s to 8 s nothing that is sent comes, before and after all does."""
    arrived = [n for _, n in passed(Radio(loss=1.0, from_s=5.0, until_s=8.0), inbound=inbound)]
    assert arrived == [*range(500), *range(800, COUNT)]


def test_one_direction_may_be_bad_and_the_other_good() -> None:
    deaf = Radio(loss=1.0, direction="to_vehicle")
    assert passed(deaf, inbound=True) == []
    assert len(passed(deaf)) == COUNT
    mute = Radio(loss=1.0, direction="to_station")
    assert passed(mute) == []
    assert len(passed(mute, inbound=True)) == COUNT


@BOTH_WAYS
def test_of_radios_at_the_same_time_the_first_counts(inbound: bool) -> None:
    radios = (Radio(loss=1.0, from_s=5.0, until_s=8.0), Radio(delay_s=0.5))
    arrived = passed(*radios, inbound=inbound)
    assert [n for _, n in arrived] == [*range(500), *range(800, COUNT)]
    assert all(t == pytest.approx(n * 0.01 + 0.5) for t, n in arrived)


@BOTH_WAYS
def test_a_delay_that_ends_keeps_the_order(inbound: bool) -> None:
    """What comes after waits for what is still under way."""
    arrived = passed(Radio(delay_s=1.0, until_s=5.0), inbound=inbound)
    assert [n for _, n in arrived] == list(range(COUNT))
    times = {n: t for t, n in arrived}
    assert (times[500], times[700]) == pytest.approx((5.99, 7.0))


def garbled(radio: Radio, datagrams: list[bytes]) -> list[bytes]:
    ours, theirs = MemoryLink.pair()
    link = ImpairedLink(ours, (radio,), (3,), lambda: 0.0)
    for datagram in datagrams:
        link.send(datagram)
    return theirs.receive()


def test_corruption_changes_one_byte_of_some() -> None:
    sent = [bytes([i % 256] * 20) for i in range(COUNT)]
    received = garbled(Radio(corruption=0.1), sent)
    wrong = [
        sum(a != b for a, b in zip(s, r, strict=True)) for s, r in zip(sent, received, strict=True)
    ]
    assert set(wrong) == {0, 1}
    assert sum(wrong) == pytest.approx(0.1 * COUNT, abs=5 * math.sqrt(0.09 * COUNT))
    places = {i for s, r in zip(sent, received, strict=True) for i in range(20) if s[i] != r[i]}
    assert places == set(range(20))


def test_a_garbled_datagram_may_be_empty() -> None:
    assert garbled(Radio(corruption=1.0), [b""]) == [b""]


def test_no_garbled_frame_is_ever_read() -> None:
    """Each byte of a frame, changed in every way there is: CRC-16 sees them all."""
    frame = Encoder(250, 190).arm(2)
    assert len(Decoder().decode(frame)) == 1
    for at in range(len(frame)):
        for mask in range(1, 256):
            broken = frame[:at] + bytes([frame[at] ^ mask]) + frame[at + 1 :]
            assert Decoder().decode(broken) == [], (at, mask)


def over(link: MemoryLink | UdpLink, peer: MemoryLink | UdpLink, radio: Radio) -> list[list[bytes]]:
    """What a vehicle and a station get of 300 datagrams each way, one each 10 ms."""
    now_s = [0.0]
    vehicle = ImpairedLink(link, (radio,), (5,), lambda: now_s[0])
    heard: list[list[bytes]] = [[], []]
    for tick in range(400):
        now_s[0] = tick * 0.01
        if tick < 300:
            vehicle.send(b"down %d" % tick)
            peer.send(b"up %d" % tick)
            if isinstance(link, UdpLink):
                select.select([link], [], [], 5.0)
        heard[0] += vehicle.receive()
        heard[1] += peer.receive()  # at once: a socket's buffer holds fewer than all of them
    return heard


def test_over_udp_the_same_datagrams_have_the_same_fate() -> None:
    radio = Radio(
        loss=0.2, delay_s=0.1, jitter_s=0.1, duplication=0.2, reordering=0.2, corruption=0.2
    )
    in_memory = over(*MemoryLink.pair(), radio)
    with closing(UdpLink.bind("127.0.0.1", 0)) as ours:
        port = ours._socket.getsockname()[1]
        with closing(UdpLink.connect("127.0.0.1", port)) as theirs:
            theirs.send(b"hello")
            select.select([ours], [], [], 5.0)
            assert ours.receive() == [b"hello"]
            assert over(ours, theirs, radio) == in_memory
    assert [len(h) for h in in_memory] != [300, 300]
