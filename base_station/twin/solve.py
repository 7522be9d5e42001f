"""Sequential impulses: contacts and the ground's hold are settled together, without restitution.

Every impulse is bounded in sum, not in its steps: contacts never pull, rims rub within Coulomb's
bound, and the ground holds back what is pushed too weakly, as in the world.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import inlined
from base_station.twin.contact import (
    GIVEN_E,
    GIVEN_N,
    GIVEN_RUB,
    IMPULSE,
    LIGHT_1,
    LIGHT_2,
    MAY_CLOSE,
    NORMAL_E,
    NORMAL_MASS,
    NORMAL_N,
    RIM_MASS,
    RUB,
    SPIN_1,
    SPIN_2,
)
from base_station.twin.drive import TINY, clipped
from base_station.twin.state import V_EAST, V_NORTH, YAW_RATE
from base_station.twin.tile import (
    BUSY,
    CHANGE,
    COS,
    FRICTION,
    HELD_E,
    HELD_N,
    HELD_SIDE,
    HELD_YAW,
    LOSS,
    SIDE_LOSS,
    SIN,
    YAW_LOSS,
)

ITERATIONS = 12  # enough for a push through a chain of three
SETTLED_NS = 1e-4  # no impulse changes by more: 0.01 mm/s of a rover


@inlined
def solve_contacts(
    vehicles: Any, tile: Any, contacts: Any, bodies: Any, n: int, worlds: Any
) -> None:
    """Change velocities so that no gap closes further than to touch. A lane that has settled
    (BUSY 0) stays as it is, so that it does not matter which worlds share a tile."""
    radius, ground = vehicles.radius_m, tile.shape[0] - 1
    for _ in range(ITERATIONS):
        worlds[CHANGE] = 0.0
        for row in range(n):
            k: Any = np.uintp(row)
            i, j = bodies[k, 0], bodies[k, 1]
            push(tile, i, j, contacts, k, radius[i], radius[j] if j < ground else 0.0, worlds)
            for lane in range(tile.shape[2]):
                light, spin = contacts[k, LIGHT_1, lane], contacts[k, SPIN_1, lane]
                tile[i, V_NORTH, lane] -= light * contacts[k, GIVEN_N, lane]
                tile[i, V_EAST, lane] -= light * contacts[k, GIVEN_E, lane]
                tile[i, YAW_RATE, lane] -= spin * contacts[k, GIVEN_RUB, lane]
            for lane in range(tile.shape[2]):
                light, spin = contacts[k, LIGHT_2, lane], contacts[k, SPIN_2, lane]
                tile[j, V_NORTH, lane] += light * contacts[k, GIVEN_N, lane]
                tile[j, V_EAST, lane] += light * contacts[k, GIVEN_E, lane]
                tile[j, YAW_RATE, lane] -= spin * contacts[k, GIVEN_RUB, lane]
        for v in range(ground):
            hold(tile, v, worlds)
        going = 0
        for lane in range(tile.shape[2]):
            going += worlds[CHANGE, lane] > SETTLED_NS
            worlds[BUSY, lane] = 1.0 if worlds[CHANGE, lane] > SETTLED_NS else 0.0
        if going == 0:
            break


@inlined
def push(
    tile: Any, i: int, j: int, contacts: Any, k: int, rim_i: float, rim_j: float, worlds: Any
) -> None:
    """The impulse of one contact: against the approach, then against the slip of the rims."""
    for lane in range(tile.shape[2]):
        nn, ne = contacts[k, NORMAL_N, lane], contacts[k, NORMAL_E, lane]
        north = tile[i, V_NORTH, lane] - tile[j, V_NORTH, lane]
        east = tile[i, V_EAST, lane] - tile[j, V_EAST, lane]
        turning = rim_i * tile[i, YAW_RATE, lane] + rim_j * tile[j, YAW_RATE, lane]
        closing = north * nn + east * ne - contacts[k, MAY_CLOSE, lane]
        before = contacts[k, IMPULSE, lane]
        impulse = max(0.0, before + closing * contacts[k, NORMAL_MASS, lane])
        slip = east * nn - north * ne + turning
        rubbed = contacts[k, RUB, lane]
        bound = worlds[FRICTION, lane] * impulse
        rub = clipped(rubbed + slip * contacts[k, RIM_MASS, lane], bound)
        normal = worlds[BUSY, lane] * (impulse - before)
        across = worlds[BUSY, lane] * (rub - rubbed)
        contacts[k, GIVEN_N, lane] = nn * normal - ne * across
        contacts[k, GIVEN_E, lane] = ne * normal + nn * across
        contacts[k, GIVEN_RUB, lane] = across
        contacts[k, IMPULSE, lane] = before + normal
        contacts[k, RUB, lane] = rubbed + across
        worlds[CHANGE, lane] = max(worlds[CHANGE, lane], max(abs(normal), abs(across)))


@inlined
def hold(tile: Any, v: int, worlds: Any) -> None:
    """What the ground takes of a velocity, afresh: no more in sum than it can hold."""
    for lane in range(tile.shape[2]):
        c, s = tile[v, COS, lane], tile[v, SIN, lane]
        north, east, rate = tile[v, V_NORTH, lane], tile[v, V_EAST, lane], tile[v, YAW_RATE, lane]
        before = tile[v, HELD_YAW, lane]
        scrub = clipped(before - rate, tile[v, YAW_LOSS, lane]) - before
        before = tile[v, HELD_SIDE, lane]
        side = clipped(before - (c * east - s * north), tile[v, SIDE_LOSS, lane]) - before
        side, scrub = worlds[BUSY, lane] * side, worlds[BUSY, lane] * scrub
        north, east = north - s * side, east + c * side
        held_n, held_e = tile[v, HELD_N, lane], tile[v, HELD_E, lane]
        wanted_n, wanted_e = held_n - north, held_e - east
        size = math.sqrt(wanted_n * wanted_n + wanted_e * wanted_e)
        share = min(1.0, tile[v, LOSS, lane] / max(size, TINY))
        roll_n = worlds[BUSY, lane] * (share * wanted_n - held_n)
        roll_e = worlds[BUSY, lane] * (share * wanted_e - held_e)
        tile[v, V_NORTH, lane], tile[v, V_EAST, lane] = north + roll_n, east + roll_e
        tile[v, YAW_RATE, lane] = rate + scrub
        tile[v, HELD_N, lane], tile[v, HELD_E, lane] = held_n + roll_n, held_e + roll_e
        tile[v, HELD_SIDE, lane] += side
        tile[v, HELD_YAW, lane] += scrub
