"""What a twin has heard of the set-points sent: as late and as seldom as the link lets through.

Nobody knows which set-point got lost; but how many reports do is seen, and so is the round trip.
Draw 0 hears all of them; the others lose as many as the link does, each its own. A change of mode
is confirmed, but late or never: half of the draws change when it was due, half when it is known.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station.execution import Orders, hold
from base_station.receiving.telemetry import Frame

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LATEST_TICKS = 20  # older orders are not remembered: a link that slow is as good as lost


@dataclass(frozen=True, eq=False)
class Hearing:
    """`setpoints` [D, V, 3] and `driven` [D, V] as heard by each of D draws; `past`: as sent."""

    setpoints: Array
    driven: Flags
    past: tuple[Orders, ...]

    def of_rows(self, rows: int) -> tuple[Array, Flags]:
        """Set-points [rows, V, 3] and driven [rows, V]: each draw for rows / D rows in turn."""
        times = rows // len(self.setpoints)
        return np.repeat(self.setpoints, times, axis=0), np.repeat(self.driven, times, axis=0)


def nothing_yet(draws: int, vehicles: int, past: tuple[Orders, ...] = ()) -> Hearing:
    """Everybody in HOLD, or under the last of the orders sent in the `past`."""
    last = past[-1] if past else hold(vehicles)
    setpoints = np.broadcast_to(last.setpoints, (draws, vehicles, 3))
    driven = np.broadcast_to(last.driven, (draws, vehicles))
    return Hearing(setpoints, driven, past[-LATEST_TICKS:])


def heard(hearing: Hearing, orders: Orders, frame: Frame, period_s: float) -> Hearing:
    """One more tick: `orders` are sent, and those that arrive now are taken."""
    past = (*hearing.past, orders)[-LATEST_TICKS:]
    late = np.minimum(np.nan_to_num(frame.delay_s) / period_s, len(past) - 1).astype(np.intp)
    vehicles = np.arange(len(late))
    arriving = np.stack([o.setpoints for o in past])[-1 - late, vehicles]
    due = np.stack([o.driven for o in past])[-1 - late, vehicles]
    half = (np.arange(len(hearing.driven)) % 2 == 0)[:, None]
    setpoints = np.broadcast_to(arriving, hearing.setpoints.shape)
    if frame.loss.any():
        rng = np.random.default_rng(round(frame.time_s * 1000))
        lost = rng.random(setpoints.shape[:2]) < frame.loss
        lost[0] = False
        setpoints = np.where(lost[..., None], hearing.setpoints, setpoints)
    return replace(
        hearing, setpoints=setpoints, driven=np.where(half, due, frame.driven), past=past
    )
