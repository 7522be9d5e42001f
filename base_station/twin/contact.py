"""Contacts of discs with each other, with walls and with obstacles: found and measured.

A contact is a row of `contacts` [C, CONTACT_COLUMNS, lanes] for one pair of blocks of the tile,
`bodies` [C, 2] (the second is the ground for walls and obstacles). In lanes where the two are out
of reach it is FAR, and does nothing. Indices of blocks are unsigned: as such they can't count from
the end, and the compiler sees which columns belong together.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import inlined
from base_station.twin.state import EAST, NORTH
from base_station.twin.tile import BUSY, INVERSE_INERTIA, INVERSE_MASS

NORMAL_N = 0  # unit vector from the first to the second
NORMAL_E = 1
GAP = 2  # m
MAY_CLOSE = 3  # m/s: the gap over dt
NORMAL_MASS = 4  # kg: impulse per change of the speed along the normal ...
RIM_MASS = 5  # ... and of the slip of the rims
IMPULSE = 6  # N s, along the normal; never pulls
RUB = 7  # N s, across it
LIGHT_1 = 8  # inverse masses (1/kg), and radius over inertia (1/(kg m)), of both
LIGHT_2 = 9
SPIN_1 = 10
SPIN_2 = 11
APART = 12  # kg m: what overlaps is moved apart by this times its inverse mass
GIVEN_N = 13  # N s, in this round: north, east, and across
GIVEN_E = 14
GIVEN_RUB = 15
CONTACT_COLUMNS = 16

FAR_MPS = 1e9
CORRECTION = 0.5  # share of a penetration removed per step
CENTRED_M = 1e-9  # nearer than this no direction is right: any one separates the two
NO_MASS = 1e-30


@inlined
def find_contacts(
    vehicles: Any, tile: Any, pairs: Any, found: int, contacts: Any, bodies: Any, worlds: Any
) -> int:
    """Fill `contacts` and `bodies`; returns how many. BUSY becomes 1 in lanes with a contact."""
    ground, obstacles = tile.shape[0] - 1, vehicles.obstacles_m.shape[0]
    radius, reach, per_dt = vehicles.radius_m, vehicles.reach_m, 1.0 / vehicles.dt_s
    row: Any
    i: Any
    axis: Any
    n = 0
    worlds[BUSY] = 0.0
    for k in range(found + (2 + obstacles) * ground):
        row = np.uintp(n)
        if k < found:
            i, j = pairs[k, 0], pairs[k, 1]
            near = measure_vehicle(tile, i, j, radius[i] + radius[j], reach, contacts, row)
        else:
            side = (k - found) % (2 + obstacles)
            i, j, axis = np.uintp((k - found) // (2 + obstacles)), np.uintp(ground), np.uintp(side)
            if side < 2:
                near = measure_wall(
                    vehicles.bounds_m, tile, i, axis, radius[i], reach, contacts, row
                )
            else:
                stroke = vehicles.obstacles_m[side - 2]
                near = measure_obstacle(stroke, tile, i, radius[i], reach, contacts, row)
        if near > 0:
            bodies[n, 0], bodies[n, 1] = i, j
            rim = radius[j] if j < ground else 0.0
            enter(tile, i, j, radius[i], rim, reach, per_dt, contacts, row, worlds)
            n += 1
            if n == bodies.shape[0]:
                break
    return n


@inlined
def measure_vehicle(
    tile: Any, i: int, j: int, touch: float, reach: float, contacts: Any, n: int
) -> int:
    """In how many lanes these are within reach, and then normal and gap of contact `n`."""
    near = 0
    for lane in range(tile.shape[2]):
        north = tile[j, NORTH, lane] - tile[i, NORTH, lane]
        east = tile[j, EAST, lane] - tile[i, EAST, lane]
        near += north * north + east * east < (touch + reach) * (touch + reach)
    if near > 0:
        for lane in range(tile.shape[2]):
            north = tile[j, NORTH, lane] - tile[i, NORTH, lane]
            east = tile[j, EAST, lane] - tile[i, EAST, lane]
            distance = math.sqrt(north * north + east * east)
            per = 1.0 / max(distance, CENTRED_M)
            contacts[n, NORMAL_N, lane] = north * per if distance >= CENTRED_M else 1.0
            contacts[n, NORMAL_E, lane] = east * per
            contacts[n, GAP, lane] = distance - touch
    return near


@inlined
def measure_wall(
    walls: Any, tile: Any, i: int, axis: int, radius: float, reach: float, contacts: Any, n: int
) -> int:
    """The same for the nearer wall along an axis: 0 north, 1 east."""
    is_east = 1.0 if axis > 0 else 0.0
    low = walls[2] if axis > 0 else walls[0]
    high = walls[3] if axis > 0 else walls[1]
    near = 0
    for lane in range(tile.shape[2]):
        at = tile[i, axis, lane]
        near += min(at - low, high - at) < radius + reach
    if near > 0:
        for lane in range(tile.shape[2]):
            to_low, to_high = tile[i, axis, lane] - low, high - tile[i, axis, lane]
            sign = -1.0 if to_low < to_high else 1.0
            contacts[n, NORMAL_N, lane] = sign * (1.0 - is_east)
            contacts[n, NORMAL_E, lane] = sign * is_east
            contacts[n, GAP, lane] = min(to_low, to_high) - radius
    return near


@inlined
def measure_obstacle(
    stroke: Any, tile: Any, i: int, radius: float, reach: float, contacts: Any, n: int
) -> int:
    """The same for a stroke of a round brush: what is met is a disc around its nearest point."""
    along_n, along_e = stroke[2] - stroke[0], stroke[3] - stroke[1]
    per_square = 1.0 / max(along_n * along_n + along_e * along_e, CENTRED_M * CENTRED_M)
    touch, near = radius + stroke[4], 0
    for lane in range(tile.shape[2]):
        north, east = stroke[0] - tile[i, NORTH, lane], stroke[1] - tile[i, EAST, lane]
        share = max(0.0, min(1.0, -(north * along_n + east * along_e) * per_square))
        north, east = north + share * along_n, east + share * along_e
        distance = math.sqrt(north * north + east * east)
        per = 1.0 / max(distance, CENTRED_M)
        near += distance < touch + reach
        contacts[n, NORMAL_N, lane] = north * per if distance >= CENTRED_M else 1.0
        contacts[n, NORMAL_E, lane] = east * per
        contacts[n, GAP, lane] = distance - touch
    return near


@inlined
def enter(
    tile: Any,
    i: int,
    j: int,
    rim_i: float,
    rim_j: float,
    reach: float,
    per_dt: float,
    contacts: Any,
    n: int,
    worlds: Any,
) -> None:
    """Complete contact `n`; what overlaps is moved apart a little, the lighter one further."""
    overlaps = 0
    for lane in range(tile.shape[2]):
        gap = contacts[n, GAP, lane]
        light_i, light_j = tile[i, INVERSE_MASS, lane], tile[j, INVERSE_MASS, lane]
        spin_i = rim_i * tile[i, INVERSE_INERTIA, lane]
        spin_j = rim_j * tile[j, INVERSE_INERTIA, lane]
        mass = 1.0 / max(light_i + light_j, NO_MASS)
        overlaps += gap < 0.0
        contacts[n, MAY_CLOSE, lane] = max(gap, 0.0) * per_dt if gap < reach else FAR_MPS
        contacts[n, NORMAL_MASS, lane] = mass
        rims = light_i + light_j + rim_i * spin_i + rim_j * spin_j
        contacts[n, RIM_MASS, lane] = 1.0 / max(rims, NO_MASS)
        contacts[n, IMPULSE, lane] = contacts[n, RUB, lane] = 0.0
        contacts[n, LIGHT_1, lane], contacts[n, LIGHT_2, lane] = light_i, light_j
        contacts[n, SPIN_1, lane], contacts[n, SPIN_2, lane] = spin_i, spin_j
        contacts[n, APART, lane] = CORRECTION * max(-gap, 0.0) * mass
        worlds[BUSY, lane] = 1.0 if gap < reach else worlds[BUSY, lane]
    if overlaps > 0:
        for lane in range(tile.shape[2]):
            move = contacts[n, APART, lane] * contacts[n, LIGHT_1, lane]
            tile[i, NORTH, lane] -= contacts[n, NORMAL_N, lane] * move
            tile[i, EAST, lane] -= contacts[n, NORMAL_E, lane] * move
        for lane in range(tile.shape[2]):
            move = contacts[n, APART, lane] * contacts[n, LIGHT_2, lane]
            tile[j, NORTH, lane] += contacts[n, NORMAL_N, lane] * move
            tile[j, EAST, lane] += contacts[n, NORMAL_E, lane] * move
