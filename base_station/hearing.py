"""What a twin has heard of the orders sent: as late and as seldom as the link lets them through.

Nobody knows which command got lost; but how many reports do is seen, and so is the round trip. Row
0 hears all of them; the others lose as many as the link does, each its own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.commander import REPEAT_S
from base_station.execution import Orders, hold
from base_station.telemetry import Frame

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LATEST_TICKS = 20  # older orders are not remembered: a link that slow is as good as lost


@dataclass(frozen=True, eq=False)
class Hearing:
    """`setpoints` [D, V, 3] and `driven` [D, V] as heard by each of D draws.

    `retry` [D, V]: ticks until a mode change that got lost is sent again. `past`: orders sent.
    """

    setpoints: Array
    driven: Flags
    retry: NDArray[np.intp]
    past: tuple[Orders, ...]

    def of_rows(self, rows: int) -> tuple[Array, Flags]:
        """Set-points [rows, V, 3] and driven [rows, V]: each draw for rows / D rows in turn."""
        times = rows // len(self.setpoints)
        return np.repeat(self.setpoints, times, axis=0), np.repeat(self.driven, times, axis=0)


def nothing_yet(draws: int, vehicles: int, past: tuple[Orders, ...] = ()) -> Hearing:
    """Everybody in HOLD, or under the last of the orders sent in the `past`."""
    last = past[-1] if past else hold(vehicles)
    shape = (draws, vehicles)
    return Hearing(
        np.broadcast_to(last.setpoints, (*shape, 3)),
        np.broadcast_to(last.driven, shape),
        np.zeros(shape, dtype=np.intp),
        past[-LATEST_TICKS:],
    )


def heard(hearing: Hearing, orders: Orders, frame: Frame, period_s: float) -> Hearing:
    """One more tick: `orders` are sent, and those that arrive now are taken."""
    past = (*hearing.past, orders)[-LATEST_TICKS:]
    late = np.minimum(np.nan_to_num(frame.delay_s) / period_s, len(past) - 1).astype(np.intp)
    vehicles = np.arange(len(late))
    setpoints = np.stack([o.setpoints for o in past])[-1 - late, vehicles]
    driven = np.stack([o.driven for o in past])[-1 - late, vehicles]
    if not frame.loss.any() and not hearing.retry.any():
        shape = hearing.driven.shape
        everything = np.broadcast_to(setpoints, (*shape, 3)), np.broadcast_to(driven, shape)
        return Hearing(*everything, hearing.retry, past)
    rng = np.random.default_rng(round(frame.time_s * 1000))
    through = rng.random(hearing.driven.shape) >= frame.loss
    through[0] = True
    changes = hearing.driven != driven
    before = past[-2 - late.max()] if len(past) > 1 + late.max() else past[0]
    again = changes & ((hearing.retry == 0) | (before.driven != driven))
    taken = again & through
    retry = np.where(again & ~through, round(REPEAT_S / period_s), np.maximum(hearing.retry - 1, 0))
    now_driven = np.where(taken, driven, hearing.driven)
    now_setpoints = np.where((through & now_driven)[..., None], setpoints, hearing.setpoints)
    return Hearing(now_setpoints, now_driven, np.where(taken, 0, retry), past)
