"""The walls of the arena: bounds of a velocity's parts along north and east.

Settled in the same rounds as the contacts, but they need no rows of their own: what walls take off
a velocity stands with the vehicle, per axis, positive for the northern and the eastern wall.
"""

from typing import Any

from base_station.twin.compiled import inlined
from base_station.twin.drive import clipped
from base_station.twin.lanes import (
    anywhere,
    least,
    magnitude,
    most,
    put,
    shortened,
    signed,
    take,
    where,
)
from base_station.twin.state import EAST, NORTH, V_EAST, V_NORTH, YAW_RATE
from base_station.twin.tile import (
    BUSY,
    CORRECTION,
    HIGHEST,
    INVERSE_INERTIA,
    LOWEST,
    MASS,
    RIM_SHARE,
    RUBBED,
    STOPPED,
    TOUCHED,
    shift,
)


@inlined
def find_walls(vehicles: Any, tile: Any, places: Any, walled: Any) -> bool:
    """Who is near a wall in any lane, into `walled` [V]; whether anybody is.

    BUSY of the ground becomes 1 in these lanes.
    """
    ground, found = tile.shape[0] - 1, False
    for v in range(ground):
        south, north = gaps(vehicles, places, v, NORTH)
        west, east = gaps(vehicles, places, v, EAST)
        near = least(least(south, north), least(west, east)) < vehicles.reach_m
        walled[v] = anywhere(near)
        if walled[v]:
            found = True
            put(tile, ground, BUSY, where(near, 1.0, take(tile, ground, BUSY)))
            keep_between(vehicles, tile, places, v, NORTH, south, north)
            keep_between(vehicles, tile, places, v, EAST, west, east)
    return found


@inlined
def gaps(vehicles: Any, places: Any, v: int, axis: int) -> Any:
    """From the rim to both walls of an axis, m."""
    at, radius = take(places, v, axis), vehicles.radius_m[v]
    low, high = vehicles.bounds_m[2 * axis] + radius, vehicles.bounds_m[2 * axis + 1] - radius
    return shortened(at - low), shortened(high - at)


@inlined
def keep_between(
    vehicles: Any, tile: Any, places: Any, v: int, axis: int, low_m: Any, high_m: Any
) -> None:
    """The speeds that take it as far as to the walls; what overlaps is moved back a little."""
    per_step = 1.0 / vehicles.dt_s
    put(tile, v, LOWEST + axis, -per_step * most(low_m, 0.0))
    put(tile, v, HIGHEST + axis, per_step * most(high_m, 0.0))
    put(tile, v, STOPPED + axis, 0.0)
    put(tile, v, RUBBED + axis, 0.0)
    if anywhere(least(low_m, high_m) < 0.0):
        shift(places, v, axis, CORRECTION * (most(-low_m, 0.0) - most(-high_m, 0.0)))


@inlined
def stop(
    vehicles: Any, tile: Any, v: int, friction: Any, busy: Any, eager: float, locked: bool
) -> Any:
    """Walls stop a vehicle, and rub its rim; returns by how much that has changed (N s)."""
    north = stop_along(vehicles, tile, v, NORTH, friction, busy, eager, locked)
    east = stop_along(vehicles, tile, v, EAST, friction, busy, eager, locked)
    return take(tile, v, MASS) * most(north, east)


@inlined
def stop_along(
    vehicles: Any,
    tile: Any,
    v: int,
    axis: int,
    friction: Any,
    busy: Any,
    eager: float,
    locked: bool,
) -> Any:
    """The same along an axis, in m/s."""
    ahead, aside = V_NORTH + axis, V_EAST - axis
    speed, before = take(tile, v, ahead), take(tile, v, STOPPED + axis)
    above = most(0.0, before + eager * (speed - take(tile, v, HIGHEST + axis)))
    below = least(0.0, before + eager * (speed - take(tile, v, LOWEST + axis)))
    stopped = above + below
    along, rubbed = take(tile, v, aside), take(tile, v, RUBBED + axis)
    slip = along
    if not locked:
        rim, rate = vehicles.radius_m[v], take(tile, v, YAW_RATE)
        turns = signed(1.0 - 2.0 * axis, (1.0 - 2.0 * axis) * stopped)
        slip = take(tile, v, RIM_SHARE) * (slip + turns * rim * rate)
    rub = clipped(rubbed + slip, friction * magnitude(stopped))
    normal, across = busy * (stopped - before), busy * (rub - rubbed)
    put(tile, v, ahead, speed - normal)
    put(tile, v, aside, along - across)
    put(tile, v, STOPPED + axis, before + normal)
    put(tile, v, RUBBED + axis, rubbed + across)
    if not locked:
        turned = rim * take(tile, v, INVERSE_INERTIA) * take(tile, v, MASS)
        put(tile, v, YAW_RATE, rate - turns * turned * across)
    return most(magnitude(normal), magnitude(across))


@inlined
def note_walls(tile: Any, walled: Any) -> None:
    for v in range(tile.shape[0] - 1):
        if walled[v]:
            stopped = magnitude(take(tile, v, STOPPED)) + magnitude(take(tile, v, STOPPED + 1))
            put(tile, v, TOUCHED, where(stopped > 0.0, 1.0, take(tile, v, TOUCHED)))
