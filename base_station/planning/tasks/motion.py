"""One control period of a batch of twins, and who met whom on the way."""

import numpy as np
from numpy.typing import NDArray

from base_station.planning.tasks.limits import Contacts, closing_mps
from base_station.twin import FaultArrays, FleetModel, Parameters, advance_in_place

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

LOOK_S = 0.1  # between looks at closing speeds; not below the largest latency of a set-point


def move(
    model: FleetModel,
    parameters: Parameters,
    faults: FaultArrays,
    states: Array,
    setpoints: Array,
    driven: Flags,
    period_s: float,
    walls: Flags,
    contacts: Contacts,
) -> None:
    """Move states [B, V, S] on under set-points [B, V, 3], in place; adds to `walls` [B, V] and
    `contacts`.

    The speed at which a pair meets is the closing speed up to LOOK_S before the first impulse.
    """

    def run(duration_s: float, impulses: Array) -> None:
        advance_in_place(
            model, parameters, faults, states, setpoints, driven, duration_s, impulses, walls
        )

    if not contacts.speeds_mps.size:
        run(period_s, contacts.impulses_ns)
        return
    looks = max(1, round(period_s / LOOK_S))
    for _ in range(looks):
        closing = closing_mps(states)
        impulses = np.zeros_like(contacts.impulses_ns)
        run(period_s / looks, impulses)
        met = np.where(impulses > 0.0, closing, 0.0)
        np.maximum(contacts.speeds_mps, met, out=contacts.speeds_mps)
        contacts.impulses_ns[...] += impulses
