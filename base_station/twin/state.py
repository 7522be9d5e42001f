"""The state of one vehicle in a twin: S named columns of a float64 row."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

NORTH = 0  # m, true position
EAST = 1
YAW = 2  # rad, [-pi, pi)
V_NORTH = 3  # m/s, true velocity
V_EAST = 4
YAW_RATE = 5  # rad/s
I_X = 6  # integrators of the autopilot's velocity loop, body axes, motor output
I_Y = 7
HELD_NORTH = 8  # m, what a stuck GPS axis goes on reporting, on average
HELD_EAST = 9
SP_NORTH = 10  # m/s, set-point in effect; of a heading-first vehicle its speed along SP_YAW, and 0
SP_EAST = 11
SP_YAW = 12  # rad
DRIVEN = 13  # 1: follows the set-point; 0: HOLD, all wheels free
AHEAD = 14  # of a heading-first autopilot: speed and turn rate that it asks for, m/s ...
TURN = 15  # ... and rad/s, ...
THROTTLE = 16  # ... and the output of its speed loop, which slews
STATE_SIZE = 17


def initial_state(positions_m: ArrayLike, yaws_rad: ArrayLike) -> Array:
    """Vehicles at rest in HOLD: positions [..., V, 2] and yaws [..., V] to states [..., V, S].

    A GPS axis that is stuck from here on repeats the position given.
    """
    positions = np.asarray(positions_m, dtype=np.float64)
    states = np.zeros((*positions.shape[:-1], STATE_SIZE))
    states[..., NORTH : EAST + 1] = positions
    states[..., HELD_NORTH : HELD_EAST + 1] = positions
    states[..., YAW] = (np.asarray(yaws_rad, dtype=np.float64) + np.pi) % (2.0 * np.pi) - np.pi
    states[..., SP_YAW] = states[..., YAW]
    return states
