"""Whatever the radio: rates within binomial bounds, order, and delays by the clock given."""

import math
from collections import Counter

from hypothesis import given, settings
from hypothesis import strategies as st

from hil.impairment import HELD_BACK_S, ImpairedLink
from hil.link import MemoryLink
from hil.scenario import Radio

COUNT, PERIOD_S, NEVER = 500, 0.02, 1e-10
SHARES = st.floats(0.0, 0.9)
DELAYS = st.floats(0.0, 2.0)
SEEDS = st.integers(0, 2**31 - 1)


def arrivals(radios: tuple[Radio, ...], seed: int, inbound: bool) -> list[tuple[int, bytes]]:
    """(tick, datagram) of those that came, of one sent at each of `COUNT` ticks."""
    ours, theirs = MemoryLink.pair()
    now_s = [0.0]
    link = ImpairedLink(ours, radios, (seed,), lambda: now_s[0])
    came = []
    for tick in range(COUNT + 250):
        now_s[0] = tick * PERIOD_S
        if tick < COUNT:
            (theirs if inbound else link).send(tick.to_bytes(2, "big") * 4)
        received = link.receive()
        came += [(tick, d) for d in (received if inbound else theirs.receive())]
    return came


def tail(k: int, n: int, p: float) -> float:
    """The smaller of P(X <= k) and P(X >= k) for X ~ Binomial(n, p), summed exactly."""

    def mass(i: int) -> float:
        if p in (0.0, 1.0):
            return float(i == n * p)
        ways = math.lgamma(n + 1) - math.lgamma(i + 1) - math.lgamma(n - i + 1)
        return math.exp(ways + i * math.log(p) + (n - i) * math.log1p(-p))

    return min(sum(map(mass, range(k + 1))), sum(map(mass, range(k, n + 1))))


def number(datagram: bytes) -> int:
    """Which one it was: garble hits one of its four copies."""
    words = Counter(datagram[i : i + 2] for i in range(0, 8, 2))
    return int.from_bytes(words.most_common(1)[0][0], "big")


@settings(max_examples=60, deadline=None)
@given(SHARES, SHARES, SHARES, SEEDS, st.booleans())
def test_rates(
    loss: float, duplication: float, corruption: float, seed: int, inbound: bool
) -> None:
    radio = Radio(loss=loss, duplication=duplication, corruption=corruption)
    came = [d for _, d in arrivals((radio,), seed, inbound)]
    times = Counter(map(number, came))
    assert set(times.values()) <= {1, 2}
    assert tail(COUNT - len(times), COUNT, loss) > NEVER
    assert tail(list(times.values()).count(2), len(times), duplication) > NEVER
    broken = {number(d) for d in came if d != number(d).to_bytes(2, "big") * 4}
    assert tail(len(broken), len(times), corruption) > NEVER


@settings(max_examples=60, deadline=None)
@given(SHARES, SEEDS, st.booleans())
def test_reordering(reordering: float, seed: int, inbound: bool) -> None:
    """Those held back are overtaken by the ten that follow within 0.2 s, if one of them is not."""
    came = arrivals((Radio(reordering=reordering),), seed, inbound)
    assert sorted(number(d) for _, d in came) == list(range(COUNT))
    late = [number(d) for tick, d in came if tick > number(d)]
    assert all(t - number(d) in (0, round(HELD_BACK_S / PERIOD_S)) for t, d in came)
    assert tail(len(late), COUNT, reordering) > NEVER


@settings(max_examples=60, deadline=None)
@given(SHARES, DELAYS, DELAYS, SEEDS, st.booleans())
def test_delay_and_jitter_by_the_clock_given_and_in_order(
    loss: float, delay_s: float, jitter_s: float, seed: int, inbound: bool
) -> None:
    came = arrivals((Radio(loss=loss, delay_s=delay_s, jitter_s=jitter_s),), seed, inbound)
    numbers = [number(d) for _, d in came]
    assert numbers == sorted(numbers)
    for tick, datagram in came:
        late_s = (tick - number(datagram)) * PERIOD_S
        assert delay_s - 1e-6 <= late_s <= delay_s + jitter_s + PERIOD_S


@settings(max_examples=60, deadline=None)
@given(st.integers(0, COUNT), st.integers(1, COUNT), DELAYS, SEEDS, st.booleans())
def test_a_black_out_takes_what_is_sent_in_it_and_nothing_else(
    begin: int, length: int, delay_s: float, seed: int, inbound: bool
) -> None:
    until_s = (begin + length) * PERIOD_S
    dark = Radio(loss=1.0, from_s=begin * PERIOD_S, until_s=until_s)
    came = [number(d) for _, d in arrivals((dark, Radio(delay_s=delay_s)), seed, inbound)]
    assert came == [n for n in range(COUNT) if not begin <= n < begin + length]


@settings(max_examples=30, deadline=None)
@given(SHARES, SHARES, DELAYS, SEEDS, st.booleans())
def test_the_same_seed_is_the_same_fate(
    loss: float, share: float, delay_s: float, seed: int, inbound: bool
) -> None:
    radio = Radio(loss=loss, delay_s=delay_s, duplication=share, reordering=share, corruption=share)
    assert arrivals((radio,), seed, inbound) == arrivals((radio,), seed, inbound)
