"""Moving a batch of twins forward in time, and what the station would receive from them."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from base_station.twin.kernel import advance_rows
from base_station.twin.model import FaultArrays, FleetModel, Parameters
from base_station.twin.state import EAST, HELD_EAST, HELD_NORTH, NORTH

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

# the kernel is compiled for one kind of arrays; a read-only one would compile it again, for seconds
WRITABLE: tuple[Literal["C"], Literal["W"]] = ("C", "W")


@dataclass(frozen=True, eq=False)
class Advanced:
    """Where a batch came to, and what it met on the way.

    `states` [B, V, S]; `impulses_ns` [B, V, V], the sum of normal contact impulses per pair (N s),
    symmetric; `walls` [B, V], whether a vehicle touched a wall.
    """

    states: Array
    impulses_ns: Array
    walls: Flags


def advance(
    model: FleetModel,
    parameters: Parameters,
    faults: FaultArrays,
    states: Array,
    setpoints: ArrayLike,
    driven: ArrayLike,
    duration_s: float,
) -> Advanced:
    """Move states [B, V, S] on by `duration_s` (to the nearest multiple of dt) into new arrays.

    `setpoints` [B, V, 3] or [V, 3] are velocities north and east (m/s) and yaw (rad; NaN: as
    before); `driven` [B, V] or [V] is False for vehicles in HOLD. Row b is under hypothesis b % H
    and has the parameters of draw b // (B / P); B must be a multiple of H and of P.
    """
    rows, count, _ = states.shape
    states = np.array(states, dtype=np.float64, order="C")
    impulses = np.zeros((rows, count, count))
    walls = np.zeros((rows, count), dtype=np.bool_)
    setpoints = np.broadcast_to(np.asarray(setpoints, dtype=np.float64), (rows, count, 3))
    driven = np.broadcast_to(np.asarray(driven, dtype=np.bool_), (rows, count))
    advance_in_place(
        model, parameters, faults, states, setpoints, driven, duration_s, impulses, walls
    )
    return Advanced(states, impulses, walls)


def advance_in_place(
    model: FleetModel,
    parameters: Parameters,
    faults: FaultArrays,
    states: Array,
    setpoints: Array,
    driven: Flags,
    duration_s: float,
    impulses_ns: Array,
    walls: Flags,
) -> None:
    """As `advance`, but changes `states`, and adds to `impulses_ns` and `walls`.

    `impulses_ns` may have shape [B, 0, 0] when nobody asks for it: for large fleets.
    """
    rows, draws, hypotheses = len(states), len(parameters.friction), len(faults.power)
    if rows % draws or rows % hypotheses:
        raise ValueError(
            f"{rows} batch rows do not divide into {draws} parameter draws and {hypotheses} "
            "hypotheses; use multiples of both"
        )
    steps = round(duration_s / model.dt_s)
    advance_rows(
        model.vehicles,
        parameters,
        faults,
        states,
        np.require(setpoints, requirements=WRITABLE),
        np.require(driven, requirements=WRITABLE),
        steps,
        impulses_ns,
        walls,
    )


def report(states: Array, faults: FaultArrays) -> Array:
    """What the station would receive on average, [B, V, 2] north and east (m).

    The true position, except on stuck axes, where it is the held one.
    """
    hypotheses, count, _ = faults.gps_stuck.shape
    shape = (len(states) // hypotheses, hypotheses, count, 2)
    true_m = states[..., NORTH : EAST + 1].reshape(shape)
    held_m = states[..., HELD_NORTH : HELD_EAST + 1].reshape(shape)
    return np.where(faults.gps_stuck > 0.0, held_m, true_m).reshape(-1, count, 2)
