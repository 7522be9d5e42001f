"""What a twin has heard of the set-points sent: as late and as seldom as the link lets through.

Nobody knows which set-point got lost; but how many reports do is seen, and so are the round trip
and its spread. Draw 0 hears all of them as late as usual; the others lose as many as the link does,
and have round trips of their own. Half of them lose what they lose whenever a report does not
come, too: a black-out takes both. A change of mode is confirmed, but late or never: half of the
draws change when it was due, half when it is known.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from base_station.execution import Orders, hold
from base_station.receiving.telemetry import Frame

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

REMEMBERED = 20  # orders: a link that is slower is as good as lost
AT_ONCE_S = 1e-3  # rounding
BAD_LOSS, WORST = 0.1, 2.0


@dataclass(frozen=True, eq=False)
class Sent:
    """Orders that answer a report of `time_s`; when they arrive, and its spread, [V] each."""

    orders: Orders
    time_s: float
    delay_s: Array
    jitter_s: Array


@dataclass(frozen=True, eq=False)
class Hearing:
    """`setpoints` [D, V, 3] and `driven` [D, V] as heard by each of D draws; `past`: as sent.

    `last`: the report that the next orders answer.
    """

    setpoints: Array
    driven: Flags
    past: tuple[Sent, ...] = ()
    last: Frame | None = None

    def of_rows(self, rows: int) -> tuple[Array, Flags]:
        """Set-points [rows, V, 3] and driven [rows, V]: each draw for rows / D rows in turn."""
        times = rows // len(self.setpoints)
        return np.repeat(self.setpoints, times, axis=0), np.repeat(self.driven, times, axis=0)


def nothing_yet(draws: int, vehicles: int, before: Iterable[tuple[Orders, Frame]] = ()) -> Hearing:
    """Everybody in HOLD, or under the last of the orders `before`, each with the frame after it."""
    past: tuple[Sent, ...] = ()
    last: Frame | None = None
    orders = hold(vehicles)
    for orders, frame in before:
        past = (*past, _sent(orders, last or frame))[-REMEMBERED:]
        last = frame
    setpoints = np.broadcast_to(orders.setpoints, (draws, vehicles, 3))
    driven = np.broadcast_to(orders.driven, (draws, vehicles))
    return Hearing(setpoints, driven, past, last)


def heard(hearing: Hearing, orders: Orders, frame: Frame, period_s: float) -> Hearing:
    """One more tick, up to `frame`: `orders` are sent; those that arrive until then are taken."""
    begin_s = frame.time_s - period_s
    answered = hearing.last or replace(frame, time_s=begin_s)
    past = (*hearing.past, _sent(orders, answered))[-REMEMBERED:]
    arriving, due, ends = _mixed(past, begin_s, frame.time_s, len(hearing.driven))
    lost = _lost(frame, len(hearing.driven))
    setpoints = np.where(lost[..., None], hearing.setpoints, arriving)
    due = np.where(lost, hearing.driven, due)
    told = (np.arange(len(due)) % 4 >= 2)[:, None]
    driven = np.where(told, frame.driven | ends, due)
    return Hearing(setpoints, driven, past, frame)


def trouble(frame: Frame, period_s: float) -> Array:
    """[V] 0 to WORST: how much of what a link might do to orders there is to reckon with.

    Where many orders get lost, several in a row do, too.
    """
    return np.clip(np.maximum(frame.loss / BAD_LOSS, frame.jitter_s / period_s), 0.0, WORST)


def _sent(orders: Orders, answered: Frame) -> Sent:
    delay_s, jitter_s = np.nan_to_num(answered.delay_s), np.nan_to_num(answered.jitter_s)
    return Sent(orders, answered.time_s, delay_s, jitter_s)


def _lost(frame: Frame, draws: int) -> Flags:
    """[D, V]: what gets lost on the way."""
    rng = np.random.default_rng(round(frame.time_s * 1000))
    alone = rng.random((draws, len(frame.loss))) < frame.loss
    odd = (np.arange(draws) % 2 == 1)[:, None]
    lost = np.where(odd, ~frame.came, alone)
    lost[0] = False
    return lost


def _mixed(
    past: tuple[Sent, ...], begin_s: float, end_s: float, draws: int
) -> tuple[Array, Flags, Flags]:
    """Set-points [D, V, 3] and driven [D, V] of a tick in which one order may follow another: a
    mean velocity, and driven if in any part of it; and whether that ends in it."""
    vehicles = np.arange(len(past[0].delay_s))
    setpoints = np.stack([s.orders.setpoints for s in past])
    driven = np.stack([s.orders.driven for s in past])
    luck = _luck(draws, len(vehicles))
    arrivals_s = np.stack([s.time_s + np.maximum(s.delay_s + luck * s.jitter_s, 0.0) for s in past])
    old, new = _newest(arrivals_s, begin_s + AT_ONCE_S), _newest(arrivals_s, end_s - AT_ONCE_S)
    taken_s = np.take_along_axis(arrivals_s, new[None], axis=0)[0]
    part = np.where(new == old, 0.0, np.clip((taken_s - begin_s) / (end_s - begin_s), 0.0, 1.0))
    mean = (1.0 - part[..., None]) * setpoints[new, vehicles]
    mean = mean + part[..., None] * setpoints[old, vehicles]
    now, before = driven[new, vehicles], (part > 0.0) & driven[old, vehicles]
    return mean, now | before, before & ~now


def _newest(arrivals_s: Array, time_s: float) -> NDArray[np.intp]:
    """[D, V]: which of K orders, arriving at [K, D, V], is the newest that has come by `time_s`."""
    count = np.arange(len(arrivals_s))[:, None, None]
    return np.asarray(np.where(arrivals_s <= time_s, count, 0).max(axis=0), dtype=np.intp)


@lru_cache
def _luck(draws: int, vehicles: int) -> Array:
    """[D, V]: by how many standard deviations later."""
    luck = np.random.default_rng(0).standard_normal((draws, vehicles))
    luck[0] = 0.0
    return luck
