"""Scripted driving: get behind a disc, then drive through it (batched, pure)."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

GAP_M = 0.25  # between the discs on the way round
LATERAL_M = 0.08  # how well aligned it must be to push


def get_behind(
    position_m: Array, centre_m: Array, direction: Array, reach_m: float
) -> tuple[Array, Flags]:
    """Where [N, 2] discs at `position_m` [N, 2] must drive to get round those at `centre_m` and
    push along unit vectors `direction` [N, 2]; and whether they are there [N].

    `reach_m` is the sum of the radii.
    """
    offset = position_m - centre_m
    along = (offset * direction).sum(axis=1, keepdims=True)
    side = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    across = (offset * side).sum(axis=1, keepdims=True)
    hand = np.where(across >= 0.0, 1.0, -1.0)
    clear = reach_m + GAP_M
    spot = centre_m - clear * direction
    corner = spot + hand * clear * side
    beside = centre_m + hand * clear * side
    far_side = along > 0.0
    passing = (along > -0.9 * reach_m) & (np.abs(across) > 0.9 * reach_m)
    goal = np.where(far_side & ~passing, beside + along * direction, spot)
    goal = np.where(passing | (far_side & (np.abs(across) > reach_m)), corner, goal)
    aligned = np.abs(across) <= LATERAL_M
    ready: Flags = (~far_side & aligned)[:, 0]
    return goal, ready
