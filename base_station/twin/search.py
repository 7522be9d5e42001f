"""Which pairs of vehicles may touch: all of a small fleet, those in neighbouring cells of a large.

Cost grows linearly in vehicles either way of what is asked of it.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import compiled
from base_station.twin.state import EAST, NORTH

CELLS_ABOVE = 16  # vehicles; below, looking at every pair in all lanes at once is cheaper
NEIGHBOURS = 10  # pairs remembered per vehicle: six equal discs fit around one


@compiled
def pair_capacity(count: int) -> int:
    return count * (count - 1) // 2 if count <= CELLS_ABOVE else NEIGHBOURS * count


@compiled
def all_pairs(count: int, pairs: Any) -> int:
    """Fill `pairs` [P, 2] with i < j; returns how many."""
    n = 0
    for i in range(count):
        for j in range(i + 1, count):
            pairs[n, 0], pairs[n, 1] = i, j
            n += 1
    return n


@compiled
def near_pairs(tile: Any, radius: Any, reach: float, pairs: Any) -> int:
    """As `all_pairs`, from neighbouring cells of a hashed grid over the positions in lane 0."""
    count = tile.shape[0] - 1
    cell = 2.0 * radius.max() + reach
    buckets = 2 * count
    head = np.full(buckets, -1, np.int64)
    following = np.empty(count, np.int64)
    cells = np.empty((count, 2), np.int64)
    n = 0
    for i in range(count):  # each vehicle meets those entered before it
        a, b = math.floor(tile[i, NORTH, 0] / cell), math.floor(tile[i, EAST, 0] / cell)
        for da in range(-1, 2):
            for db in range(-1, 2):
                j = head[bucket(a + da, b + db, buckets)]
                while j >= 0:
                    here = cells[j, 0] == a + da and cells[j, 1] == b + db
                    if here and n < pairs.shape[0] and near(tile, radius, reach, i, j):
                        pairs[n, 0], pairs[n, 1] = j, i
                        n += 1
                    j = following[j]
        k = bucket(a, b, buckets)
        cells[i, 0], cells[i, 1] = a, b
        following[i], head[k] = head[k], i
    return n


@compiled
def near(tile: Any, radius: Any, reach: float, i: int, j: int) -> bool:
    north = tile[j, NORTH, 0] - tile[i, NORTH, 0]
    east = tile[j, EAST, 0] - tile[i, EAST, 0]
    result: bool = north * north + east * east < (radius[i] + radius[j] + reach) ** 2
    return result


@compiled
def bucket(a: int, b: int, buckets: int) -> int:
    return (a * 73856093 ^ b * 19349663) % buckets
