"""Starts for curricula: around a vehicle in all directions, nothing that knows the layout."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from base_station.twin import FleetModel

Array = NDArray[np.float64]

GAP_M = (0.05, 1.2)  # between the vehicle in the middle and one placed near it
WALL_MARGIN_M = 0.05


def scattered(
    model: FleetModel,
    rng: np.random.Generator,
    centre_m: Array,
    who: Sequence[int],
    around: int,
) -> Array:
    """Places [N, len(who), 2] around vehicle `around` at `centre_m` [N, 2], inside the walls.

    Each vehicle gets a sector of its own, so that none starts inside another.
    """
    n, k, radius = len(centre_m), len(who), model.vehicles.radius_m
    sector = np.argsort(rng.random((n, k)), axis=1) + rng.uniform(-0.2, 0.2, (n, k))
    angle = 2.0 * np.pi * (rng.random((n, 1)) + sector / max(k, 2))
    distance = radius[around] + radius[list(who)] + rng.uniform(*GAP_M, (n, k))
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return inside(model, centre_m[:, None] + distance[..., None] * direction, who)


def inside(model: FleetModel, places_m: Array, who: Sequence[int]) -> Array:
    """Places [..., len(who), 2] moved inside the walls."""
    bounds = model.vehicles.bounds_m
    margin = model.vehicles.radius_m[list(who)][:, None] + WALL_MARGIN_M
    low, high = bounds[[0, 2]] + margin, bounds[[1, 3]] - margin
    moved: Array = np.clip(places_m, low, high)
    return moved
