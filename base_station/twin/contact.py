"""Contacts between discs and with walls: search by cells, sequential impulses, no restitution.

A contact is a row: i, j (-1: a wall), normal north, normal east (from i to j), gap (m), and the
accumulated normal and tangential impulses (N s).
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import compiled
from base_station.twin.state import EAST, NORTH, V_EAST, V_NORTH, YAW_RATE

ITERATIONS = 12  # enough for a push through a chain of three
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
    row = contacts[n]
    row[0], row[1], row[2], row[3], row[4] = i, j, north / distance, east / distance, gap
    row[5] = row[6] = 0.0
    return n + 1


@compiled
def add_wall(contacts: Any, n: int, i: int, north: float, east: float, gap: float) -> int:
    if gap >= REACH_M:
        return n
    row = contacts[n]
    row[0], row[1], row[2], row[3], row[4] = i, -1.0, north, east, gap
    row[5] = row[6] = 0.0
    return n + 1


@compiled
def solve_contacts(
    s: Any, radius: Any, inverse: Any, friction: float, dt: float, contacts: Any
) -> None:
    """Change velocities so that no gap closes further than to touch. `inverse`: 1/mass, 1/inertia.

    Coulomb friction is bounded by the normal impulse so far.
    """
    for _ in range(ITERATIONS):
        for k in range(contacts.shape[0]):
            row = contacts[k]
            i, j, nn, ne = int(row[0]), int(row[1]), row[2], row[3]
            weight = inverse[i, 0] + (inverse[j, 0] if j >= 0 else 0.0)
            closing = -relative(s, i, j, nn, ne) - max(row[4], 0.0) / dt
            before = row[5]
            row[5] = max(0.0, before + closing / weight)
            push(s, inverse, i, j, nn, ne, row[5] - before)
            if row[5] == 0.0 and row[6] == 0.0:
                continue
            ri, rj = radius[i], radius[j] if j >= 0 else 0.0
            spin = s[i, YAW_RATE] * ri + (s[j, YAW_RATE] * rj if j >= 0 else 0.0)
            slip = relative(s, i, j, -ne, nn) - spin
            weight += ri * ri * inverse[i, 1] + (rj * rj * inverse[j, 1] if j >= 0 else 0.0)
            before = row[6]
            bound = friction * row[5]
            row[6] = max(-bound, min(bound, before - slip / weight))
            change = row[6] - before
            push(s, inverse, i, j, -ne, nn, change)
            s[i, YAW_RATE] -= ri * inverse[i, 1] * change
            if j >= 0:
                s[j, YAW_RATE] -= rj * inverse[j, 1] * change


@compiled
def relative(s: Any, i: int, j: int, north: float, east: float) -> float:
    """Velocity of j (or of a wall: none) seen from i, along a direction."""
    speed: float = -(s[i, V_NORTH] * north + s[i, V_EAST] * east)
    if j >= 0:
        speed += s[j, V_NORTH] * north + s[j, V_EAST] * east
    return speed


@compiled
def push(s: Any, inverse: Any, i: int, j: int, north: float, east: float, impulse: float) -> None:
    s[i, V_NORTH] -= north * impulse * inverse[i, 0]
    s[i, V_EAST] -= east * impulse * inverse[i, 0]
    if j >= 0:
        s[j, V_NORTH] += north * impulse * inverse[j, 0]
        s[j, V_EAST] += east * impulse * inverse[j, 0]


@compiled
def correct_positions(s: Any, radius: Any, bounds: Any, inverse: Any, contacts: Any) -> None:
    """Move overlapping discs apart, the lighter one further, and put all inside the walls."""
    for k in range(contacts.shape[0]):
        i, j = int(contacts[k, 0]), int(contacts[k, 1])
        if j < 0:
            continue
        north, east = s[j, NORTH] - s[i, NORTH], s[j, EAST] - s[i, EAST]
        overlap = radius[i] + radius[j] - math.sqrt(north * north + east * east)
        if overlap > 0.0:
            move = CORRECTION * overlap / (inverse[i, 0] + inverse[j, 0])
            s[i, NORTH] -= contacts[k, 2] * move * inverse[i, 0]
            s[i, EAST] -= contacts[k, 3] * move * inverse[i, 0]
            s[j, NORTH] += contacts[k, 2] * move * inverse[j, 0]
            s[j, EAST] += contacts[k, 3] * move * inverse[j, 0]
    for i in range(s.shape[0]):
        r = radius[i]
        s[i, NORTH] = max(bounds[0] + r, min(bounds[1] - r, s[i, NORTH]))
        s[i, EAST] = max(bounds[2] + r, min(bounds[3] - r, s[i, EAST]))
