"""The twin's dynamics: one deterministic kernel, batched over environments x hypotheses.

A step: autopilot, motors, the ground, contacts (sequential impulses), positions. Worlds are moved
LANES at a time, each in a lane of a tile (`tile`): one instruction serves all of them. Large
fleets are moved one world at a time, by the same functions with a single lane.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import cached, compiled, inlined, sources
from base_station.twin.contact import CONTACT_COLUMNS, IMPULSE, find_contacts
from base_station.twin.drive import drive, take_commands, wrapped
from base_station.twin.search import CELLS_ABOVE, all_pairs, near_pairs, pair_capacity
from base_station.twin.solve import solve_contacts
from base_station.twin.state import EAST, NORTH, STATE_SIZE, V_EAST, V_NORTH, YAW, YAW_RATE
from base_station.twin.tile import COLUMNS, FRICTION, WORLD_COLUMNS, face, gather

LANES = 16


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
    lanes: int,
) -> None:
    """`steps` of dt for all rows of `states`, in place; adds to `impulses` and `walls`."""
    rows, count = states.shape[0], states.shape[1]
    draws, hypotheses = parameters.mass_kg.shape[0], faults.power.shape[0]
    tile = np.zeros((count + 1, COLUMNS, lanes))
    draw, hypothesis = np.zeros(lanes, np.int64), np.zeros(lanes, np.int64)
    due, worlds = np.empty(lanes, np.int64), np.zeros((WORLD_COLUMNS, lanes))
    pairs = np.empty((pair_capacity(count), 2), np.uintp)
    found = all_pairs(count, pairs) if count <= CELLS_ABOVE else 0
    room = pairs.shape[0] + (2 + vehicles.obstacles_m.shape[0]) * count
    contacts = np.empty((room + 1, CONTACT_COLUMNS, lanes))
    bodies = np.empty((room, 2), np.uintp)
    same = draws == 1 and lanes % hypotheses == 0  # every tile has the same constants
    for first in range(0, rows, lanes):
        for lane in range(lanes):
            b = min(first + lane, rows - 1)  # lanes past the end repeat the last row
            draw[lane], hypothesis[lane] = b * draws // rows, b % hypotheses
            worlds[FRICTION, lane] = parameters.friction[draw[lane]]
            due[lane] = min(round(parameters.latency_s[draw[lane]] / vehicles.dt_s), steps)
            load(states[b], tile, lane)
        if first == 0 or not same:
            gather(vehicles, parameters, faults, draw, hypothesis, tile)
        face(tile)
        for step in range(steps + 1):
            for lane in range(lanes):
                if due[lane] == step:  # a latency longer than the call is cut to it
                    b = min(first + lane, rows - 1)
                    take_commands(vehicles, tile, lane, setpoints[b], driven[b])
            if step == steps:
                break
            for v in range(count):
                drive(vehicles, tile, v)
            if count > CELLS_ABOVE:
                found = near_pairs(tile, vehicles.radius_m, vehicles.reach_m, pairs)
            n = find_contacts(vehicles, tile, pairs, found, contacts, bodies, worlds)
            if n > 0:
                solve_contacts(vehicles, tile, contacts, bodies, n, worlds)
                note_contacts(contacts, bodies, n, first, impulses, walls)
            move(tile, vehicles.dt_s)
            if not vehicles.yaw_locked:
                face(tile)
        for lane in range(min(lanes, rows - first)):
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
def move(tile: Any, dt: float) -> None:
    for v in range(tile.shape[0] - 1):
        for lane in range(tile.shape[2]):
            tile[v, NORTH, lane] += tile[v, V_NORTH, lane] * dt
            tile[v, EAST, lane] += tile[v, V_EAST, lane] * dt
            tile[v, YAW, lane] = wrapped(tile[v, YAW, lane] + tile[v, YAW_RATE, lane] * dt)


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


def _entry(version: int, lanes: int) -> Any:
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
                lanes,
            )

    return cached(advance_rows)


_side_by_side, _alone = _entry(sources(), LANES), _entry(sources(), 1)


def advance_rows(vehicles: Any, *rest: Any) -> None:
    """As `advance_all`, with as many lanes as suit the size of the fleet."""
    kernel = _side_by_side if len(vehicles.radius_m) <= CELLS_ABOVE else _alone
    kernel(vehicles, *rest)
