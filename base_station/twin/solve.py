"""Sequential impulses: contacts and the ground's hold are settled together, without restitution.

Every impulse is bounded in sum, not in its steps: contacts never pull, rims rub within Coulomb's
bound, and the ground holds back what is pushed too weakly, as in the world.
"""

from typing import Any

from base_station.twin.compiled import inlined
from base_station.twin.contact import (
    IMPULSE,
    MAY_CLOSE,
    NORMAL_E,
    NORMAL_MASS,
    NORMAL_N,
    RIM_MASS,
    RUB,
)
from base_station.twin.drive import TINY, clipped
from base_station.twin.lanes import anywhere, least, magnitude, most, put, root, take, where
from base_station.twin.state import V_EAST, V_NORTH, YAW_RATE
from base_station.twin.tile import (
    BUSY,
    COS,
    FRICTION,
    HELD_E,
    HELD_N,
    HELD_SIDE,
    HELD_YAW,
    INVERSE_INERTIA,
    INVERSE_MASS,
    LOSS,
    SIDE_LOSS,
    SIN,
    YAW_LOSS,
)
from base_station.twin.walls import stop

ITERATIONS = 8
EAGER = 1.3  # over-relaxation: as exact in 8 rounds as plain ones in 12
SETTLED_NS = 1e-4  # no impulse changes by more: 0.01 mm/s of a rover


@inlined
def solve_contacts(
    vehicles: Any,
    tile: Any,
    contacts: Any,
    bodies: Any,
    between: int,
    n: int,
    walled: Any,
    locked: bool,
) -> None:
    """Change velocities so that no gap closes further than to touch. The first `between` of `n`
    contacts are those of two vehicles. A lane that has settled (BUSY 0) stays as it is, so that it
    does not matter which worlds share a tile."""
    ground = tile.shape[0] - 1
    friction, busy = take(tile, ground, FRICTION), take(tile, ground, BUSY)
    eager = 1.0
    i: Any
    j: Any
    for _ in range(ITERATIONS):
        change = 0.0 * friction
        for row in range(between):
            i = bodies[row, 0]
            j = bodies[row, 1]
            given = push(vehicles, tile, i, j, contacts, row, friction, busy, eager, locked)
            change = most(change, given)
        for row in range(between, n):
            i = bodies[row, 0]
            given = push_off(vehicles, tile, i, contacts, row, friction, busy, eager, locked)
            change = most(change, given)
        for v in range(ground):
            if walled[v]:
                change = most(change, stop(vehicles, tile, v, friction, busy, eager, locked))
            hold(vehicles, tile, v, busy, locked)
        going = change > SETTLED_NS
        if not anywhere(going):
            break
        busy = where(going, 1.0, 0.0)
        eager = EAGER  # not at first: what a single plain round settles is settled then


@inlined
def push(
    vehicles: Any,
    tile: Any,
    i: int,
    j: int,
    contacts: Any,
    k: int,
    friction: Any,
    busy: Any,
    eager: float,
    locked: bool,
) -> Any:
    """The impulse of two vehicles: against the approach, then against the slip of the rims.

    Returns by how much it has changed (N s)."""
    nn, ne = take(contacts, k, NORMAL_N), take(contacts, k, NORMAL_E)
    light_i, light_j = take(tile, i, INVERSE_MASS), take(tile, j, INVERSE_MASS)
    north_i, north_j = take(tile, i, V_NORTH), take(tile, j, V_NORTH)
    east_i, east_j = take(tile, i, V_EAST), take(tile, j, V_EAST)
    north, east = north_i - north_j, east_i - east_j
    slip = east * nn - north * ne
    if not locked:
        rim_i, rim_j = vehicles.radius_m[i], vehicles.radius_m[j]
        rate_i, rate_j = take(tile, i, YAW_RATE), take(tile, j, YAW_RATE)
        slip = slip + (rim_i * rate_i + rim_j * rate_j)
    closing = north * nn + east * ne - take(contacts, k, MAY_CLOSE)
    normal, across = bounded(contacts, k, closing, slip, friction, busy, eager)
    give_n, give_e = nn * normal - ne * across, ne * normal + nn * across
    put(tile, i, V_NORTH, north_i - light_i * give_n)
    put(tile, i, V_EAST, east_i - light_i * give_e)
    put(tile, j, V_NORTH, north_j + light_j * give_n)
    put(tile, j, V_EAST, east_j + light_j * give_e)
    if not locked:
        put(tile, i, YAW_RATE, rate_i - rim_i * take(tile, i, INVERSE_INERTIA) * across)
        put(tile, j, YAW_RATE, rate_j - rim_j * take(tile, j, INVERSE_INERTIA) * across)
    return most(magnitude(normal), magnitude(across))


@inlined
def push_off(
    vehicles: Any,
    tile: Any,
    i: int,
    contacts: Any,
    k: int,
    friction: Any,
    busy: Any,
    eager: float,
    locked: bool,
) -> Any:
    """The same against the ground, which does not move."""
    nn, ne = take(contacts, k, NORMAL_N), take(contacts, k, NORMAL_E)
    light, north, east = take(tile, i, INVERSE_MASS), take(tile, i, V_NORTH), take(tile, i, V_EAST)
    slip = east * nn - north * ne
    if not locked:
        rim, rate = vehicles.radius_m[i], take(tile, i, YAW_RATE)
        slip = slip + rim * rate
    closing = north * nn + east * ne - take(contacts, k, MAY_CLOSE)
    normal, across = bounded(contacts, k, closing, slip, friction, busy, eager)
    put(tile, i, V_NORTH, north - light * (nn * normal - ne * across))
    put(tile, i, V_EAST, east - light * (ne * normal + nn * across))
    if not locked:
        put(tile, i, YAW_RATE, rate - rim * take(tile, i, INVERSE_INERTIA) * across)
    return most(magnitude(normal), magnitude(across))


@inlined
def bounded(
    contacts: Any, k: int, closing: Any, slip: Any, friction: Any, busy: Any, eager: float
) -> Any:
    """What the impulses change by, along the normal and across: bounded in sum, and noted."""
    before, rubbed = take(contacts, k, IMPULSE), take(contacts, k, RUB)
    impulse = most(0.0, before + eager * closing * take(contacts, k, NORMAL_MASS))
    rub = clipped(rubbed + slip * take(contacts, k, RIM_MASS), friction * impulse)
    normal, across = busy * (impulse - before), busy * (rub - rubbed)
    put(contacts, k, IMPULSE, before + normal)
    put(contacts, k, RUB, rubbed + across)
    return normal, across


@inlined
def hold(vehicles: Any, tile: Any, v: int, busy: Any, locked: bool) -> None:
    """What the ground takes of a velocity, afresh: no more in sum than it can hold."""
    north, east = take(tile, v, V_NORTH), take(tile, v, V_EAST)
    if not locked:
        rate, before = take(tile, v, YAW_RATE), take(tile, v, HELD_YAW)
        scrub = busy * (clipped(before - rate, take(tile, v, YAW_LOSS)) - before)
        put(tile, v, YAW_RATE, rate + scrub)
        put(tile, v, HELD_YAW, before + scrub)
    if vehicles.grips[v]:
        c, s, held = take(tile, v, COS), take(tile, v, SIN), take(tile, v, HELD_SIDE)
        wanted = held - (c * east - s * north)
        side = busy * (clipped(wanted, take(tile, v, SIDE_LOSS)) - held)
        put(tile, v, HELD_SIDE, held + side)
        north, east = north - s * side, east + c * side
    held_n, held_e = take(tile, v, HELD_N), take(tile, v, HELD_E)
    wanted_n, wanted_e = held_n - north, held_e - east
    size = root(wanted_n * wanted_n + wanted_e * wanted_e)
    share = least(1.0, take(tile, v, LOSS) / most(size, TINY))
    roll_n, roll_e = busy * (share * wanted_n - held_n), busy * (share * wanted_e - held_e)
    put(tile, v, V_NORTH, north + roll_n)
    put(tile, v, V_EAST, east + roll_e)
    put(tile, v, HELD_N, held_n + roll_n)
    put(tile, v, HELD_E, held_e + roll_e)
