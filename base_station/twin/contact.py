"""Contacts between discs and with walls: search by cells, sequential impulses, no restitution.

A contact is a row: i, j (-1: a wall), normal north, normal east (from i to j), gap (m), and the
accumulated normal and tangential impulses (N s).
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import compiled
from base_station.twin.lump import INVERSE_INERTIA, INVERSE_MASS
from base_station.twin.state import EAST, NORTH, V_EAST, V_NORTH, YAW_RATE

ITERATIONS = 12  # enough for a push through a chain of three
SETTLED_NS = 1e-7
REACH_M = 0.1  # gaps that can close within a step; above 2 x the fastest vehicle x dt
CELLS_ABOVE = 16  # below this many vehicles, looking at every pair is cheaper
CORRECTION = 0.5  # share of a penetration removed per step


@compiled
def find_contacts(s: Any, radius: Any, bounds: Any, contacts: Any) -> int:
    """Fill `contacts` with pairs and walls within reach; returns how many."""
    count = s.shape[0]
    if count > CELLS_ABOVE:
        n = near_pairs_by_cells(s, radius, contacts)
    else:
        n = 0
        for i in range(count):
            for j in range(i + 1, count):
                n = add_pair(s, radius, i, j, contacts, n)
    for i in range(count):
        north, east, r = s[i, NORTH], s[i, EAST], radius[i]
        n = add_wall(contacts, n, i, -1.0, 0.0, north - r - bounds[0])
        n = add_wall(contacts, n, i, 1.0, 0.0, bounds[1] - north - r)
        n = add_wall(contacts, n, i, 0.0, -1.0, east - r - bounds[2])
        n = add_wall(contacts, n, i, 0.0, 1.0, bounds[3] - east - r)
    return n


@compiled
def near_pairs_by_cells(s: Any, radius: Any, contacts: Any) -> int:
    """Pairs from neighbouring cells of a hashed grid: cost grows linearly in vehicles."""
    count = s.shape[0]
    cell = 2.0 * radius.max() + REACH_M
    buckets = 2 * count
    head = np.full(buckets, -1, np.int64)
    following = np.empty(count, np.int64)
    cells = np.empty((count, 2), np.int64)
    n = 0
    for i in range(count):  # each vehicle meets those entered before it
        a, b = math.floor(s[i, NORTH] / cell), math.floor(s[i, EAST] / cell)
        for da in range(-1, 2):
            for db in range(-1, 2):
                j = head[bucket(a + da, b + db, buckets)]
                while j >= 0:
                    if cells[j, 0] == a + da and cells[j, 1] == b + db:
                        n = add_pair(s, radius, j, i, contacts, n)
                    j = following[j]
        k = bucket(a, b, buckets)
        cells[i, 0], cells[i, 1] = a, b
        following[i], head[k] = head[k], i
    return n


@compiled
def bucket(a: int, b: int, buckets: int) -> int:
    return (a * 73856093 ^ b * 19349663) % buckets


@compiled
def add_pair(s: Any, radius: Any, i: int, j: int, contacts: Any, n: int) -> int:
    north, east = s[j, NORTH] - s[i, NORTH], s[j, EAST] - s[i, EAST]
    touch = radius[i] + radius[j]
    square = north * north + east * east
    if square >= (touch + REACH_M) ** 2 or n >= contacts.shape[0] - 4 * s.shape[0]:
        return n
    distance = math.sqrt(square)
    if distance < 1e-9:  # no direction is right: any one separates them
        north, east, distance = 1.0, 0.0, 1.0
        square = 0.0
    gap = math.sqrt(square) - touch
    return add_contact(contacts, n, i, j, north / distance, east / distance, gap)


@compiled
def add_wall(contacts: Any, n: int, i: int, north: float, east: float, gap: float) -> int:
    if gap >= REACH_M:
        return n
    return add_contact(contacts, n, i, -1, north, east, gap)


@compiled
def add_contact(
    contacts: Any, n: int, i: int, j: int, north: float, east: float, gap: float
) -> int:
    contacts[n, 0], contacts[n, 1] = i, j
    contacts[n, 2], contacts[n, 3], contacts[n, 4] = north, east, gap
    contacts[n, 5] = contacts[n, 6] = 0.0
    return n + 1


@compiled
def solve_contacts(
    s: Any, radius: Any, k: Any, friction: float, dt: float, contacts: Any, n: int
) -> None:
    """Change velocities so that no gap closes further than to touch. `k` is the lumped array.

    Coulomb friction is bounded by the normal impulse so far.
    """
    for _ in range(ITERATIONS):
        largest = 0.0
        for c in range(n):
            i, j = int(contacts[c, 0]), int(contacts[c, 1])
            nn, ne = contacts[c, 2], contacts[c, 3]
            weight = k[i, INVERSE_MASS] + (k[j, INVERSE_MASS] if j >= 0 else 0.0)
            closing = -relative(s, i, j, nn, ne) - max(contacts[c, 4], 0.0) / dt
            before = contacts[c, 5]
            contacts[c, 5] = max(0.0, before + closing / weight)
            push(s, k, i, j, nn, ne, contacts[c, 5] - before)
            if contacts[c, 5] > 0.0 or contacts[c, 6] != 0.0:
                rub(s, radius, k, i, j, friction * contacts[c, 5], weight, contacts, c)
            largest = max(largest, abs(contacts[c, 5] - before))
        if largest < SETTLED_NS:
            break


@compiled
def rub(
    s: Any, radius: Any, k: Any, i: int, j: int, bound: float, weight: float, contacts: Any, c: int
) -> None:
    """The tangential part: against the slip of the rims, up to `bound` (N s)."""
    nn, ne, ri = contacts[c, 2], contacts[c, 3], radius[i]
    slip = relative(s, i, j, -ne, nn) - ri * s[i, YAW_RATE]
    weight += ri * ri * k[i, INVERSE_INERTIA]
    if j >= 0:
        slip -= radius[j] * s[j, YAW_RATE]
        weight += radius[j] * radius[j] * k[j, INVERSE_INERTIA]
    before = contacts[c, 6]
    contacts[c, 6] = max(-bound, min(bound, before - slip / weight))
    change = contacts[c, 6] - before
    push(s, k, i, j, -ne, nn, change)
    s[i, YAW_RATE] -= ri * k[i, INVERSE_INERTIA] * change
    if j >= 0:
        s[j, YAW_RATE] -= radius[j] * k[j, INVERSE_INERTIA] * change


@compiled
def relative(s: Any, i: int, j: int, north: float, east: float) -> float:
    """Velocity of j (or of a wall: none) seen from i, along a direction."""
    speed: float = -(s[i, V_NORTH] * north + s[i, V_EAST] * east)
    if j >= 0:
        speed += s[j, V_NORTH] * north + s[j, V_EAST] * east
    return speed


@compiled
def push(s: Any, k: Any, i: int, j: int, north: float, east: float, impulse: float) -> None:
    s[i, V_NORTH] -= north * impulse * k[i, INVERSE_MASS]
    s[i, V_EAST] -= east * impulse * k[i, INVERSE_MASS]
    if j >= 0:
        s[j, V_NORTH] += north * impulse * k[j, INVERSE_MASS]
        s[j, V_EAST] += east * impulse * k[j, INVERSE_MASS]


@compiled
def correct_positions(s: Any, radius: Any, bounds: Any, k: Any, contacts: Any, n: int) -> None:
    """Move overlapping discs apart, the lighter one further, and put all inside the walls."""
    for c in range(n):
        i, j = int(contacts[c, 0]), int(contacts[c, 1])
        if j < 0:
            continue
        north, east = s[j, NORTH] - s[i, NORTH], s[j, EAST] - s[i, EAST]
        overlap = radius[i] + radius[j] - math.sqrt(north * north + east * east)
        if overlap > 0.0:
            move = CORRECTION * overlap / (k[i, INVERSE_MASS] + k[j, INVERSE_MASS])
            s[i, NORTH] -= contacts[c, 2] * move * k[i, INVERSE_MASS]
            s[i, EAST] -= contacts[c, 3] * move * k[i, INVERSE_MASS]
            s[j, NORTH] += contacts[c, 2] * move * k[j, INVERSE_MASS]
            s[j, EAST] += contacts[c, 3] * move * k[j, INVERSE_MASS]
    for i in range(s.shape[0]):
        r = radius[i]
        s[i, NORTH] = max(bounds[0] + r, min(bounds[1] - r, s[i, NORTH]))
        s[i, EAST] = max(bounds[2] + r, min(bounds[3] - r, s[i, EAST]))
