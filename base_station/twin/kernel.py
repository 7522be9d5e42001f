"""The twin's dynamics: one deterministic kernel, batched over environments x hypotheses.

A step: autopilot, motors, the ground, contacts (sequential impulses), positions. Worlds are moved
LANES at a time, each in a lane of a tile (`tile`): one instruction serves all of them (`lanes`).
Large fleets are moved one world at a time, by the same functions with floats.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import cached, compiled, inlined, sources
from base_station.twin.contact import CONTACT_COLUMNS, IMPULSE, find_obstacles, find_pairs
from base_station.twin.drive import drive, take_commands, wrapped
from base_station.twin.lanes import LANES, put, take, where
from base_station.twin.search import CELLS_ABOVE, all_pairs, near_pairs, pair_capacity
from base_station.twin.solve import solve_contacts
from base_station.twin.state import (
    EAST,
    HELD_NORTH,
    NORTH,
    SP_NORTH,
    STATE_SIZE,
    V_EAST,
    V_NORTH,
    YAW,
    YAW_RATE,
)
from base_station.twin.tile import COLUMNS, FRICTION, TOUCHED, aligned, face, gather, shift
from base_station.twin.walls import find_walls, note_walls


@inlined
def advance_all(
    vehicles: Any,
    parameters: Any,
    faults: Any,
    states: Any,
    setpoints: Any,
    driven: Any,
    steps: int,
    impulses: Any,
    walls: Any,
    tile: Any,
    columns: Any,
    places: Any,
    spots: Any,
    contacts: Any,
    rows: Any,
    locked: bool,
) -> None:
    """`steps` of dt for all rows of `states`, in place; adds to `impulses` and `walls`.

    `columns` and `rows` are the tile and the contacts as `take` wants them. `locked`: nothing
    turns, and what only matters to what turns is left out.
    """
    batch, count, lanes = states.shape[0], states.shape[1], tile.shape[2]
    draws, hypotheses = parameters.mass_kg.shape[0], faults.power.shape[0]
    draw, hypothesis = np.zeros(lanes, np.int64), np.zeros(lanes, np.int64)
    due = np.empty(lanes, np.int64)
    pairs = np.empty((pair_capacity(count), 2), np.uintp)
    found = all_pairs(count, pairs) if count <= CELLS_ABOVE else 0
    bodies = np.empty((contacts.shape[0], 2), np.uintp)
    walled = np.empty(count, np.bool_)
    same = draws == 1 and lanes % hypotheses == 0  # every tile has the same constants
    for first in range(0, batch, lanes):
        load(states, first, tile, places)
        if first == 0 or not same:
            for lane in range(lanes):
                b = min(first + lane, batch - 1)
                draw[lane], hypothesis[lane] = b * draws // batch, b % hypotheses
                tile[count, FRICTION, lane] = parameters.friction[draw[lane]]
                due[lane] = min(round(parameters.latency_s[draw[lane]] / vehicles.dt_s), steps)
            gather(vehicles, parameters, faults, draw, hypothesis, tile)
        face(columns)
        for step in range(steps + 1):
            for lane in range(lanes):
                if due[lane] == step:  # a latency longer than the call is cut to it
                    b = min(first + lane, batch - 1)
                    take_commands(vehicles, tile, lane, setpoints, driven, b)
            if step == steps:
                break
            for v in range(count):
                drive(vehicles, columns, v, locked)
            if count > CELLS_ABOVE:
                found = near_pairs(places, vehicles.radius_m, vehicles.reach_m, pairs)
            between = find_pairs(vehicles, columns, spots, pairs, found, rows, bodies)
            n = find_obstacles(vehicles, columns, spots, between, rows, bodies)
            if find_walls(vehicles, columns, spots, walled) or n > 0:
                solve_contacts(vehicles, columns, rows, bodies, between, n, walled, locked)
                note_walls(columns, walled)
                note_obstacles(columns, rows, bodies, between, n)
                if impulses.shape[1] > 0:
                    note_pairs(contacts, bodies, between, first, impulses)
            move(columns, spots, vehicles.dt_s, locked)
            if not locked:
                face(columns)
        store(tile, places, states, walls, first, locked)


@compiled
def load(states: Any, first: int, tile: Any, places: Any) -> None:
    """Rows from `first` on into the lanes; those past the end repeat the last row."""
    for lane in range(tile.shape[2]):
        b = min(first + lane, states.shape[0] - 1)
        for v in range(states.shape[1]):
            places[v, NORTH, lane], places[v, EAST, lane] = states[b, v, NORTH], states[b, v, EAST]
            for column in range(V_NORTH, STATE_SIZE):
                tile[v, column, lane] = states[b, v, column]
            yaw = states[b, v, YAW]
            if not -math.pi <= yaw < math.pi:
                yaw = (yaw + math.pi) % (2.0 * math.pi) - math.pi
            tile[v, YAW, lane], tile[v, TOUCHED, lane] = yaw, 0.0


@compiled
def store(tile: Any, places: Any, states: Any, walls: Any, first: int, locked: bool) -> None:
    """What nothing has changed stays as it was, to the bit: held reports, a locked yaw."""
    for lane in range(min(tile.shape[2], states.shape[0] - first)):
        b = first + lane
        for v in range(states.shape[1]):
            if tile[v, TOUCHED, lane] > 0.0:
                walls[b, v] = True
            states[b, v, NORTH], states[b, v, EAST] = places[v, NORTH, lane], places[v, EAST, lane]
            if not locked:
                states[b, v, YAW] = tile[v, YAW, lane]
            for column in range(V_NORTH, HELD_NORTH):
                states[b, v, column] = tile[v, column, lane]
            for column in range(SP_NORTH, STATE_SIZE):
                states[b, v, column] = tile[v, column, lane]


@inlined
def move(tile: Any, places: Any, dt: float, locked: bool) -> None:
    for v in range(tile.shape[0] - 1):
        shift(places, v, NORTH, take(tile, v, V_NORTH) * dt)
        shift(places, v, EAST, take(tile, v, V_EAST) * dt)
        if not locked:
            put(tile, v, YAW, wrapped(take(tile, v, YAW) + take(tile, v, YAW_RATE) * dt))


@inlined
def note_obstacles(tile: Any, rows: Any, bodies: Any, between: int, n: int) -> None:
    for row in range(between, n):
        i: Any = bodies[row, 0]
        met = take(rows, row, IMPULSE) > 0.0
        put(tile, i, TOUCHED, where(met, 1.0, take(tile, i, TOUCHED)))


@compiled
def note_pairs(contacts: Any, bodies: Any, between: int, first: int, impulses: Any) -> None:
    """Add normal impulses (N s) to [B, V, V]."""
    for k in range(between):
        i, j = bodies[k, 0], bodies[k, 1]
        for lane in range(min(contacts.shape[2], impulses.shape[0] - first)):
            impulse = contacts[k, IMPULSE, lane]
            if impulse > 0.0:
                impulses[first + lane, i, j] += impulse
                impulses[first + lane, j, i] += impulse


@compiled
def room(vehicles: Any) -> int:
    """How many contacts there may be."""
    count = vehicles.radius_m.shape[0]
    result: int = pair_capacity(count) + vehicles.obstacles_m.shape[0] * count
    return result


def _side_by_side(version: int, locked: bool) -> Any:
    def advance_rows(
        vehicles: Any,
        parameters: Any,
        faults: Any,
        states: Any,
        setpoints: Any,
        driven: Any,
        steps: int,
        impulses: Any,
        walls: Any,
    ) -> None:
        if version != 0:  # read, so that the cache knows it
            tile = aligned(states.shape[1] + 1, COLUMNS, LANES, np.float32)
            places = aligned(states.shape[1] + 1, 2, LANES, np.float64)
            contacts = aligned(room(vehicles), CONTACT_COLUMNS, LANES, np.float32)
            advance_all(
                vehicles,
                parameters,
                faults,
                states,
                setpoints,
                driven,
                steps,
                impulses,
                walls,
                tile,
                tile,
                places,
                places,
                contacts,
                contacts,
                locked,
            )

    return cached(advance_rows)


def _alone(version: int, locked: bool) -> Any:
    def advance_rows(
        vehicles: Any,
        parameters: Any,
        faults: Any,
        states: Any,
        setpoints: Any,
        driven: Any,
        steps: int,
        impulses: Any,
        walls: Any,
    ) -> None:
        if version != 0:  # read, so that the cache knows it
            blocks, capacity = states.shape[1] + 1, room(vehicles)
            tile = aligned(blocks, COLUMNS, 1, np.float64)
            places = aligned(blocks, 2, 1, np.float64)
            contacts = aligned(capacity, CONTACT_COLUMNS, 1, np.float64)
            advance_all(
                vehicles,
                parameters,
                faults,
                states,
                setpoints,
                driven,
                steps,
                impulses,
                walls,
                tile,
                tile.reshape(blocks, COLUMNS),
                places,
                places.reshape(blocks, 2),
                contacts,
                contacts.reshape(capacity, CONTACT_COLUMNS),
                locked,
            )

    return cached(advance_rows)


_KERNELS = {
    (alone, locked): entry(sources(), locked)
    for alone, entry in ((False, _side_by_side), (True, _alone))
    for locked in (False, True)
}


def advance_rows(vehicles: Any, *rest: Any) -> None:
    """As `advance_all`, with as many lanes as suit the size of the fleet."""
    locked = bool(vehicles.yaw_locked and not vehicles.skid.any())
    _KERNELS[len(vehicles.radius_m) > CELLS_ABOVE, locked](vehicles, *rest)
