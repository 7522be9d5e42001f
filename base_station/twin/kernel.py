"""The twin's dynamics: one deterministic kernel, batched over environments x hypotheses.

A step: autopilot, motors, the ground, contacts (sequential impulses), positions. Worlds are moved
LANES at a time, each in a lane of a tile (`tile`): one instruction serves all of them (`lanes`).
Large fleets are moved one world at a time, by the same functions with floats.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import cached, compiled, inlined, sources
from base_station.twin.contact import CONTACT_COLUMNS, IMPULSE, find_pairs, find_walls
from base_station.twin.drive import drive, take_commands, wrapped
from base_station.twin.lanes import LANES, put, take
from base_station.twin.search import CELLS_ABOVE, all_pairs, near_pairs, pair_capacity
from base_station.twin.solve import solve_contacts
from base_station.twin.state import EAST, NORTH, STATE_SIZE, V_EAST, V_NORTH, YAW, YAW_RATE
from base_station.twin.tile import COLUMNS, FRICTION, aligned, face, gather


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
    same = draws == 1 and lanes % hypotheses == 0  # every tile has the same constants
    for first in range(0, batch, lanes):
        for lane in range(lanes):
            b = min(first + lane, batch - 1)  # lanes past the end repeat the last row
            draw[lane], hypothesis[lane] = b * draws // batch, b % hypotheses
            tile[count, FRICTION, lane] = parameters.friction[draw[lane]]
            due[lane] = min(round(parameters.latency_s[draw[lane]] / vehicles.dt_s), steps)
            load(states[b], tile, lane)
        if first == 0 or not same:
            gather(vehicles, parameters, faults, draw, hypothesis, tile)
        face(columns)
        for step in range(steps + 1):
            for lane in range(lanes):
                if due[lane] == step:  # a latency longer than the call is cut to it
                    b = min(first + lane, batch - 1)
                    take_commands(vehicles, tile, lane, setpoints[b], driven[b])
            if step == steps:
                break
            for v in range(count):
                drive(vehicles, columns, v, locked)
            if count > CELLS_ABOVE:
                found = near_pairs(tile, vehicles.radius_m, vehicles.reach_m, pairs)
            between = find_pairs(vehicles, columns, pairs, found, rows, bodies)
            n = find_walls(vehicles, columns, between, rows, bodies)
            if n > 0:
                solve_contacts(vehicles, columns, rows, bodies, between, n, locked)
                note_contacts(contacts, bodies, n, first, impulses, walls)
            move(columns, vehicles.dt_s, locked)
            if not locked:
                face(columns)
        for lane in range(min(lanes, batch - first)):
            store(tile, lane, states[first + lane])


@compiled
def load(state: Any, tile: Any, lane: int) -> None:
    for v in range(state.shape[0]):
        for column in range(STATE_SIZE):
            tile[v, column, lane] = state[v, column]
        tile[v, YAW, lane] = (state[v, YAW] + math.pi) % (2.0 * math.pi) - math.pi


@compiled
def store(tile: Any, lane: int, state: Any) -> None:
    for v in range(state.shape[0]):
        for column in range(STATE_SIZE):
            state[v, column] = tile[v, column, lane]


@inlined
def move(tile: Any, dt: float, locked: bool) -> None:
    for v in range(tile.shape[0] - 1):
        put(tile, v, NORTH, take(tile, v, NORTH) + take(tile, v, V_NORTH) * dt)
        put(tile, v, EAST, take(tile, v, EAST) + take(tile, v, V_EAST) * dt)
        if not locked:
            put(tile, v, YAW, wrapped(take(tile, v, YAW) + take(tile, v, YAW_RATE) * dt))


@compiled
def note_contacts(
    contacts: Any, bodies: Any, n: int, first: int, impulses: Any, walls: Any
) -> None:
    """Add normal impulses (N s) to [B, V, V] if it is wanted (not empty), and mark walls [B, V]."""
    rows, count = walls.shape
    for k in range(n):
        i, j = bodies[k, 0], bodies[k, 1]
        for lane in range(min(contacts.shape[2], rows - first)):
            impulse = contacts[k, IMPULSE, lane]
            if impulse > 0.0:
                if j == count:
                    walls[first + lane, i] = True
                elif impulses.shape[1] > 0:
                    impulses[first + lane, i, j] += impulse
                    impulses[first + lane, j, i] += impulse


@compiled
def room(vehicles: Any) -> int:
    """How many contacts there may be."""
    count = vehicles.radius_m.shape[0]
    result: int = pair_capacity(count) + (2 + vehicles.obstacles_m.shape[0]) * count
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
            tile = aligned(states.shape[1] + 1, COLUMNS, LANES)
            contacts = aligned(room(vehicles), CONTACT_COLUMNS, LANES)
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
            tile = aligned(blocks, COLUMNS, 1)
            contacts = aligned(capacity, CONTACT_COLUMNS, 1)
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
