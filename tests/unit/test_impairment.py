"""The radio: loss, delay, jitter, doubles and disorder, in both directions, the same each time."""

from collections.abc import Callable

import pytest
from vehicle_world import scenario

from hil.impairment import HELD_BACK_S, ImpairedLink, impaired
from hil.link import MemoryLink
from hil.scenario import Radio, Scenario, station_view

COUNT = 2000


def passed(radio: Radio, seed: int = 1, inbound: bool = False) -> list[tuple[float, int]]:
    """When which of `COUNT` datagrams came through, one sent each 10 ms."""
    ours, theirs = MemoryLink.pair()
    now_s = [0.0]
    link = ImpairedLink(ours, radio, (seed,), lambda: now_s[0])
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
