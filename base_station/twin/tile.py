"""The kernel's working memory: a tile of some worlds side by side, one per lane.

A tile is [V + 1, COLUMNS, lanes]: block `v` has the state of vehicle v (columns as in
`state`; but see places), what it needs per step (below), and scratch. The last block is the ground
that walls and obstacles stand on: it has no inverse mass, never moves, and keeps what belongs to a
world as a whole. Lanes are innermost: a column is a few vector registers (`lanes`).

Numbers of a tile are singles, of which a register holds twice as many as of doubles: they are
fractions of a metre a second, good to 1e-7. Places [V + 1, 2, lanes], north and east, are doubles,
for they grow by steps a thousand times smaller than themselves; distances are singles again.

Acceleration (body x, y, yaw) = GIVE @ commands - DAMP @ velocity, each 3 x 3, all motors together.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import compiled, inlined
from base_station.twin.lanes import lengthened, put, take
from base_station.twin.state import STATE_SIZE, YAW

COS = STATE_SIZE  # of the yaw
SIN = COS + 1
HELD_N = COS + 2  # what the ground has taken off the velocity in this step: rolling, m/s ...
HELD_E = COS + 3
HELD_SIDE = COS + 4  # ... side grip, m/s along body y ...
HELD_YAW = COS + 5  # ... and scrub, rad/s
INVERSE_MASS = COS + 6
INVERSE_INERTIA = COS + 7  # 0 when the yaw is locked
LOSS = COS + 8  # speed lost to rolling resistance per step, m/s
SIDE_LOSS = COS + 9  # the same for side grip
YAW_LOSS = COS + 10  # and scrub, rad/s
STUCK = COS + 11  # 2 columns: the GPS axis (north, east) is frozen
PULL = COS + 13  # of one motor while they are gathered: stall force, weak or reversed, and ...
SLOWING = COS + 14  # ... stall force over free speed
MASS = COS + 15
RIM_SHARE = COS + 16  # of a rim's slip along a wall that goes into the velocity, not the turn rate
TOUCHED = COS + 17  # 1: a wall or an obstacle, in this call
LOWEST = COS + 18  # per axis (north, east): speeds between which it gets no further than ...
HIGHEST = COS + 20  # ... to a wall, m/s
STOPPED = COS + 22  # what walls have taken off the speed in this step, m/s ...
RUBBED = COS + 24  # ... and, by friction, off that along the other axis
GIVE = COS + 26  # 9 columns
DAMP = GIVE + 9  # 9 columns
COLUMNS = DAMP + 9

# of the ground's block
FRICTION = PULL  # of this world's contacts
BUSY = SLOWING  # 1: contacts are still to be settled

CORRECTION = 0.5  # share of a penetration removed per step
ALIGNED_BYTES = 64  # a vector register, and a line of the processor's cache

S_3, S_5, S_7, S_9, S_11, S_13 = (1.0 / math.factorial(n) for n in (3, 5, 7, 9, 11, 13))
C_2, C_4, C_6, C_8, C_10, C_12, C_14 = (1.0 / math.factorial(n) for n in range(2, 15, 2))


@compiled
def aligned(rows: int, columns: int, lanes: int, number: Any) -> Any:
    """Zeros [rows, columns, lanes] of which no vector crosses a line of the cache."""
    spare, size = ALIGNED_BYTES // 4, rows * columns * lanes
    raw = np.zeros(size + spare, number)
    start = (-raw.ctypes.data // raw.itemsize) % spare
    return raw[start : start + size].reshape(rows, columns, lanes)


@inlined
def gather(
    vehicles: Any, parameters: Any, faults: Any, draw: Any, hypothesis: Any, tile: Any
) -> None:
    """Fill the constants of all vehicles: lane l is of a parameter draw and a hypothesis."""
    lanes, dt = tile.shape[2], vehicles.dt_s
    for v in range(tile.shape[0] - 1):
        tile[v, GIVE:COLUMNS] = 0.0
        for lane in range(lanes):
            p, h = draw[lane], hypothesis[lane]
            per_mass = 1.0 / parameters.mass_kg[p, v]
            per_inertia = 1.0 / parameters.inertia_kgm2[p, v]
            tile[v, INVERSE_MASS, lane], tile[v, MASS, lane] = per_mass, parameters.mass_kg[p, v]
            tile[v, INVERSE_INERTIA, lane] = 0.0 if vehicles.yaw_locked else per_inertia
            spin = vehicles.radius_m[v] ** 2 * tile[v, INVERSE_INERTIA, lane]
            tile[v, RIM_SHARE, lane] = per_mass / (per_mass + spin)
            tile[v, LOSS, lane] = parameters.rolling_force_n[p, v] * per_mass * dt
            tile[v, SIDE_LOSS, lane] = parameters.side_force_n[p, v] * per_mass * dt
            tile[v, YAW_LOSS, lane] = parameters.yaw_resistance_nm[p, v] * per_inertia * dt
            tile[v, STUCK, lane] = faults.gps_stuck[h, v, 0]
            tile[v, STUCK + 1, lane] = faults.gps_stuck[h, v, 1]
        for m in range(vehicles.arm_m.shape[1]):
            gather_motor(vehicles, parameters, faults, draw, hypothesis, v, m, tile)


@inlined
def gather_motor(
    vehicles: Any,
    parameters: Any,
    faults: Any,
    draw: Any,
    hypothesis: Any,
    v: int,
    m: int,
    tile: Any,
) -> None:
    """Add one motor, with direction and arm as its row of the Jacobian."""
    for lane in range(tile.shape[2]):
        p, h = draw[lane], hypothesis[lane]
        pull = parameters.stall_force_n[p, v, m] * faults.power[h, v, m]
        tile[v, PULL, lane] = pull * faults.gain[h, v, m]
        tile[v, SLOWING, lane] = pull / parameters.free_speed_mps[p, v, m]
    for i in range(3):
        row = jacobian(vehicles, v, m, i)
        if row == 0.0:
            continue
        of = INVERSE_MASS if i < 2 else INVERSE_INERTIA
        for j in range(3):
            give, damp = row * vehicles.mix[v, m, j], row * jacobian(vehicles, v, m, j)
            for lane in range(tile.shape[2]):
                share = tile[v, of, lane]
                tile[v, GIVE + 3 * i + j, lane] += give * tile[v, PULL, lane] * share
                tile[v, DAMP + 3 * i + j, lane] += damp * tile[v, SLOWING, lane] * share


@compiled
def jacobian(vehicles: Any, v: int, m: int, i: int) -> float:
    """Wheel speed per body velocity x, y, yaw; and body force per wheel force."""
    result: float = vehicles.direction[v, m, i] if i < 2 else vehicles.arm_m[v, m]
    return result


@inlined
def shift(places: Any, v: int, axis: int, by_m: Any) -> None:
    put(places, v, axis, take(places, v, axis) + lengthened(by_m))


@inlined
def face(tile: Any) -> None:
    """COS and SIN of all yaws (within [-pi, pi)), to the last few bits.

    Series at a quarter of the angle, doubled twice: libm's functions take one number at a time.
    """
    for v in range(tile.shape[0] - 1):
        x = 0.25 * take(tile, v, YAW)
        q = -x * x
        s = x * (1.0 + q * (S_3 + q * (S_5 + q * (S_7 + q * (S_9 + q * (S_11 + q * S_13))))))
        c = 1.0 + q * (C_2 + q * (C_4 + q * (C_6 + q * (C_8 + q * (C_10 + q * (C_12 + q * C_14))))))
        s, c = 2.0 * s * c, 1.0 - 2.0 * s * s
        put(tile, v, COS, 1.0 - 2.0 * s * s)
        put(tile, v, SIN, 2.0 * s * c)
