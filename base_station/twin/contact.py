"""Contacts of discs with each other and with obstacles: found and measured.

A contact is a row of `contacts` [C, CONTACT_COLUMNS, lanes] for one pair of blocks of the tile,
`bodies` [C, 2] (the second is the ground for obstacles, which come last). In lanes where
the two are out of reach it is FAR, and does nothing. Indices of blocks are unsigned: as such they
can't count from the end.
"""

from typing import Any

import numpy as np

from base_station.twin.compiled import inlined
from base_station.twin.lanes import anywhere, least, most, put, root, shortened, take, where
from base_station.twin.state import EAST, NORTH
from base_station.twin.tile import BUSY, CORRECTION, INVERSE_INERTIA, INVERSE_MASS, shift

NORMAL_N = 0  # unit vector from the first to the second
NORMAL_E = 1
MAY_CLOSE = 2  # m/s: the gap over dt
NORMAL_MASS = 3  # kg: impulse per change of the speed along the normal ...
RIM_MASS = 4  # ... and of the slip of the rims
IMPULSE = 5  # N s, along the normal; never pulls
RUB = 6  # N s, across it
CONTACT_COLUMNS = 8  # one to spare

FAR_MPS = 1e9
CENTRED_M = 1e-9  # nearer than this no direction is right: any one separates the two
NO_MASS = 1e-30


@inlined
def find_pairs(
    vehicles: Any, tile: Any, places: Any, pairs: Any, found: int, contacts: Any, bodies: Any
) -> int:
    """Fill `contacts` and `bodies` with vehicles that may touch; returns how many.

    BUSY of the ground becomes 1 in lanes with a contact.
    """
    radius, reach = vehicles.radius_m, vehicles.reach_m
    ground, n = tile.shape[0] - 1, 0
    put(tile, ground, BUSY, 0.0 * take(tile, ground, BUSY))
    for k in range(found):
        i: Any = pairs[k, 0]
        j: Any = pairs[k, 1]
        touch = radius[i] + radius[j]
        north = shortened(take(places, j, NORTH) - take(places, i, NORTH))
        east = shortened(take(places, j, EAST) - take(places, i, EAST))
        square = north * north + east * east
        if anywhere(square < (touch + reach) * (touch + reach)):
            distance = root(square)
            per = 1.0 / most(distance, CENTRED_M)
            nn = where(distance >= CENTRED_M, north * per, 1.0)
            gap = distance - touch
            bodies[n, 0], bodies[n, 1] = i, j
            enter(vehicles, tile, places, i, j, radius[j], nn, east * per, gap, contacts, n)
            n += 1
    return n


@inlined
def find_obstacles(
    vehicles: Any, tile: Any, places: Any, n: int, contacts: Any, bodies: Any
) -> int:
    """Add what meets obstacles to the first `n` contacts; returns how many it is then."""
    radius, reach = vehicles.radius_m, vehicles.reach_m
    ground: Any = np.uintp(tile.shape[0] - 1)
    i: Any
    for k in range(vehicles.obstacles_m.shape[0]):
        stroke = vehicles.obstacles_m[k]
        along_n, along_e = stroke[2] - stroke[0], stroke[3] - stroke[1]
        per_square = 1.0 / max(along_n * along_n + along_e * along_e, CENTRED_M * CENTRED_M)
        for v in range(tile.shape[0] - 1):
            i = np.uintp(v)
            north = shortened(stroke[0] - take(places, i, NORTH))
            east = shortened(stroke[1] - take(places, i, EAST))
            share = -(north * along_n + east * along_e) * per_square
            share = most(0.0, least(1.0, share))
            north, east = north + share * along_n, east + share * along_e
            distance = root(north * north + east * east)
            gap = distance - (radius[i] + stroke[4])
            if anywhere(gap < reach):
                per = 1.0 / most(distance, CENTRED_M)
                nn = where(distance >= CENTRED_M, north * per, 1.0)
                bodies[n, 0], bodies[n, 1] = i, ground
                enter(vehicles, tile, places, i, ground, 0.0, nn, east * per, gap, contacts, n)
                n += 1
    return n


@inlined
def enter(
    vehicles: Any,
    tile: Any,
    places: Any,
    i: int,
    j: int,
    rim_j: float,
    nn: Any,
    ne: Any,
    gap: Any,
    contacts: Any,
    n: int,
) -> None:
    """Write contact `n`; what overlaps is moved apart a little, the lighter one further."""
    reach, rim_i, ground = vehicles.reach_m, vehicles.radius_m[i], tile.shape[0] - 1
    light_i, light_j = take(tile, i, INVERSE_MASS), take(tile, j, INVERSE_MASS)
    spin_i = rim_i * rim_i * take(tile, i, INVERSE_INERTIA)
    spin_j = rim_j * rim_j * take(tile, j, INVERSE_INERTIA)
    light = light_i + light_j
    mass = 1.0 / most(light, NO_MASS)
    near = gap < reach
    put(contacts, n, NORMAL_N, nn)
    put(contacts, n, NORMAL_E, ne)
    put(contacts, n, MAY_CLOSE, where(near, most(gap, 0.0) * (1.0 / vehicles.dt_s), FAR_MPS))
    put(contacts, n, NORMAL_MASS, mass)
    put(contacts, n, RIM_MASS, 1.0 / most(light + spin_i + spin_j, NO_MASS))
    put(contacts, n, IMPULSE, 0.0 * light)
    put(contacts, n, RUB, 0.0 * light)
    put(tile, ground, BUSY, where(near, 1.0, take(tile, ground, BUSY)))
    if anywhere(gap < 0.0):
        apart = CORRECTION * most(-gap, 0.0) * mass
        shift(places, i, NORTH, -nn * (apart * light_i))
        shift(places, i, EAST, -ne * (apart * light_i))
        shift(places, j, NORTH, nn * (apart * light_j))
        shift(places, j, EAST, ne * (apart * light_j))
