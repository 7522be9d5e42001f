"""Twins of the fleet: the same batched model under each hypothesis.

A state is [B, V, S]: batch row, vehicle in fleet order, column (`NORTH` .. `DRIVEN`). Batch rows
are environments x hypotheses with the hypothesis running fastest.
"""

from base_station.twin.model import (
    FaultArrays,
    FleetModel,
    Parameters,
    Vehicles,
    fault_rows,
    perturbed,
)
from base_station.twin.state import (
    AHEAD,
    DRIVEN,
    EAST,
    HELD_EAST,
    HELD_NORTH,
    I_X,
    I_Y,
    NORTH,
    SP_EAST,
    SP_NORTH,
    SP_YAW,
    STATE_SIZE,
    THROTTLE,
    TURN,
    V_EAST,
    V_NORTH,
    YAW,
    YAW_RATE,
    initial_state,
)
from base_station.twin.step import Advanced, advance, advance_in_place, report

__all__ = [
    "AHEAD",
    "DRIVEN",
    "EAST",
    "HELD_EAST",
    "HELD_NORTH",
    "I_X",
    "I_Y",
    "NORTH",
    "SP_EAST",
    "SP_NORTH",
    "SP_YAW",
    "STATE_SIZE",
    "THROTTLE",
    "TURN",
    "V_EAST",
    "V_NORTH",
    "YAW",
    "YAW_RATE",
    "Advanced",
    "FaultArrays",
    "FleetModel",
    "Parameters",
    "Vehicles",
    "advance",
    "advance_in_place",
    "fault_rows",
    "initial_state",
    "perturbed",
    "report",
]
