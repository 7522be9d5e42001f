"""What one batch row needs per vehicle, gathered once per call in one array: fast to read.

Acceleration (body x, y, yaw) = GIVE @ commands - DAMP @ velocity, each 3 x 3, all motors together.
"""

from typing import Any

from base_station.twin.compiled import compiled

GIVE = 0  # 9 columns
DAMP = 9  # 9 columns
LOSS = 18  # speed lost to rolling resistance per step, m/s
YAW_LOSS = 19  # rad/s
INVERSE_MASS = 20
INVERSE_INERTIA = 21  # 0 when the yaw is locked
STUCK = 22  # 2 columns: the GPS axis (north, east) is frozen
SPEED_LIMIT = 24
PER_SPEED = 25  # 2 columns, feed-forward of body x, y: output per m/s ...
ROLLING = 27  # 2 columns: ... and the output that overcomes rolling resistance
MIX = 29  # 3 columns per motor: outputs = MIX @ commands


@compiled
def columns(motors: int) -> int:
    return MIX + 3 * motors


@compiled
def lump(vehicles: Any, parameters: Any, faults: Any, p: int, h: int, k: Any) -> None:
    """Fill `k` [V, columns] for parameter draw `p` and hypothesis `h`."""
    dt = vehicles.dt_s
    for v in range(k.shape[0]):
        mass, inertia = parameters.mass_kg[p, v], parameters.inertia_kgm2[p, v]
        k[v, GIVE:LOSS] = 0.0
        for m in range(vehicles.arm_m.shape[1]):
            lump_motor(vehicles, parameters, faults, p, h, v, m, k)
        for i in range(3):
            for j in range(3):
                k[v, GIVE + 3 * i + j] /= mass if i < 2 else inertia
                k[v, DAMP + 3 * i + j] /= mass if i < 2 else inertia
        k[v, LOSS] = parameters.rolling_force_n[p, v] / mass * dt
        k[v, YAW_LOSS] = parameters.yaw_resistance_nm[p, v] / inertia * dt
        k[v, INVERSE_MASS] = 1.0 / mass
        k[v, INVERSE_INERTIA] = 0.0 if vehicles.yaw_locked else 1.0 / inertia
        k[v, SPEED_LIMIT] = vehicles.speed_limit_mps[v]
        for axis in range(2):
            k[v, STUCK + axis] = faults.gps_stuck[h, v, axis]
            k[v, PER_SPEED + axis] = 1.0 / vehicles.axis_free_speed_mps[v, axis]
            k[v, ROLLING + axis] = vehicles.axis_rolling[v, axis]


@compiled
def lump_motor(
    vehicles: Any, parameters: Any, faults: Any, p: int, h: int, v: int, m: int, k: Any
) -> None:
    """Add one motor, with arm and direction as its row of the Jacobian."""
    arm = vehicles.arm_m[v, m]
    pull = (vehicles.direction[v, m, 0], vehicles.direction[v, m, 1], arm)
    turn = 1.0 if arm > 0.0 else -1.0 if arm < 0.0 else 0.0
    mix = (pull[0], pull[1], turn)
    stall = parameters.stall_force_n[p, v, m] * faults.power[h, v, m]
    for i in range(3):
        k[v, MIX + 3 * m + i] = mix[i]
        for j in range(3):
            k[v, GIVE + 3 * i + j] += stall * pull[i] * mix[j]
            k[v, DAMP + 3 * i + j] += stall / vehicles.free_speed_mps[v, m] * pull[i] * pull[j]
