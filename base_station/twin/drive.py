"""One step of a vehicle's autopilot, motors and ground, for all lanes of a tile.

The autopilot's equations are those of the simulated vehicles: a velocity loop that is
feed-forward with a bounded integrator; a skid-steered frame turns towards its velocity.
"""

import math
from typing import Any

from base_station.twin.compiled import compiled, inlined
from base_station.twin.state import (
    DRIVEN,
    I_X,
    I_Y,
    SP_EAST,
    SP_NORTH,
    SP_YAW,
    V_EAST,
    V_NORTH,
    YAW,
    YAW_RATE,
)
from base_station.twin.tile import (
    COS,
    DAMP,
    GIVE,
    HELD_E,
    HELD_N,
    HELD_SIDE,
    HELD_YAW,
    LARGEST,
    LOSS,
    SIDE_LOSS,
    SIN,
    STUCK,
    U_X,
    U_Y,
    U_YAW,
    YAW_LOSS,
)

INTEGRATOR_GAIN = 0.5  # output per (m/s) s
INTEGRATOR_LIMIT = 0.1
STANDSTILL_MPS = 0.02  # set-points below this get no feed-forward against rolling resistance
YAW_GAIN = 2.0
YAW_RATE_GAIN = 0.5
YAW_LIMIT = 0.5
TURNING_MPS = 0.1  # skid-steer: slower set-points don't turn it
HEADING_GAIN = 2.0  # rad/s per rad
RATE_LIMIT_RADPS = 1.5
RATE_GAIN = 0.3  # output per rad/s
SCRUB_RATE_RADPS = 0.05  # set-point from which on scrub is fully fed forward
TINY = 1e-30


@compiled
def take_commands(vehicles: Any, tile: Any, lane: int, setpoints: Any, driven: Any) -> None:
    """Put set-points [V, 3] into effect; HOLD (not driven) forgets set-point and integrals."""
    for v in range(tile.shape[0] - 1):
        north = east = 0.0
        tile[v, DRIVEN, lane] = driven[v]
        if driven[v]:
            speed = math.hypot(setpoints[v, 0], setpoints[v, 1])
            share = min(1.0, vehicles.speed_limit_mps[v] / max(speed, TINY))
            north, east = setpoints[v, 0] * share, setpoints[v, 1] * share
            if vehicles.skid[v] and speed * share >= TURNING_MPS:
                tile[v, SP_YAW, lane] = math.atan2(east, north)
            elif not math.isnan(setpoints[v, 2]):
                tile[v, SP_YAW, lane] = setpoints[v, 2]
        else:
            tile[v, I_X, lane] = tile[v, I_Y, lane] = 0.0
        tile[v, SP_NORTH, lane], tile[v, SP_EAST, lane] = north, east


@inlined
def drive(vehicles: Any, tile: Any, v: int) -> None:
    if vehicles.skid[v]:
        skid_commands(vehicles, tile, v)
    else:
        omni_commands(vehicles, tile, v)
    for m in range(vehicles.arm_m.shape[1]):
        x, y, yaw = vehicles.mix[v, m, 0], vehicles.mix[v, m, 1], vehicles.mix[v, m, 2]
        for lane in range(tile.shape[2]):
            output = x * tile[v, U_X, lane] + y * tile[v, U_Y, lane] + yaw * tile[v, U_YAW, lane]
            tile[v, LARGEST, lane] = max(tile[v, LARGEST, lane], abs(output))
    accelerate(vehicles, tile, v)


@inlined
def omni_commands(vehicles: Any, tile: Any, v: int) -> None:
    """Body commands of the velocity loop; a stuck axis reports no velocity."""
    gain = INTEGRATOR_GAIN * vehicles.dt_s
    x_line, x_rolling = 1.0 / vehicles.axis_free_speed_mps[v, 0], vehicles.axis_rolling[v, 0]
    y_line, y_rolling = 1.0 / vehicles.axis_free_speed_mps[v, 1], vehicles.axis_rolling[v, 1]
    free = 0.0 if vehicles.yaw_locked else 1.0
    for lane in range(tile.shape[2]):
        c, s, on = tile[v, COS, lane], tile[v, SIN, lane], tile[v, DRIVEN, lane]
        sp_n, sp_e = tile[v, SP_NORTH, lane], tile[v, SP_EAST, lane]
        error_n = sp_n - (1.0 - tile[v, STUCK, lane]) * tile[v, V_NORTH, lane]
        error_e = sp_e - (1.0 - tile[v, STUCK + 1, lane]) * tile[v, V_EAST, lane]
        i_x = clipped(tile[v, I_X, lane] + gain * (c * error_n + s * error_e), INTEGRATOR_LIMIT)
        i_y = clipped(tile[v, I_Y, lane] + gain * (c * error_e - s * error_n), INTEGRATOR_LIMIT)
        yaw, rate = tile[v, YAW, lane], tile[v, YAW_RATE, lane]
        sp_yaw = tile[v, SP_YAW, lane] if on > 0.0 else yaw
        turn = clipped(YAW_GAIN * wrapped(sp_yaw - yaw) - YAW_RATE_GAIN * rate, YAW_LIMIT)
        tile[v, U_X, lane] = feed_forward(c * sp_n + s * sp_e, x_line, x_rolling) + i_x
        tile[v, U_Y, lane] = feed_forward(c * sp_e - s * sp_n, y_line, y_rolling) + i_y
        tile[v, U_YAW, lane] = free * turn
        tile[v, I_X, lane], tile[v, I_Y, lane] = on * i_x, on * i_y
        tile[v, SP_YAW, lane] = sp_yaw
        tile[v, LARGEST, lane] = 1.0


@inlined
def skid_commands(vehicles: Any, tile: Any, v: int) -> None:
    """Turn towards the velocity, and drive as much of it as lies ahead."""
    gain = INTEGRATOR_GAIN * vehicles.dt_s
    line, rolling = 1.0 / vehicles.axis_free_speed_mps[v, 0], vehicles.axis_rolling[v, 0]
    turn_line, scrub = vehicles.turn_line[v], vehicles.turn_scrub[v]
    for lane in range(tile.shape[2]):
        c, s, on = tile[v, COS, lane], tile[v, SIN, lane], tile[v, DRIVEN, lane]
        sp_n, sp_e = tile[v, SP_NORTH, lane], tile[v, SP_EAST, lane]
        ahead = c * sp_n + s * sp_e
        turning = sp_n * sp_n + sp_e * sp_e >= TURNING_MPS * TURNING_MPS
        ahead = max(0.0, ahead) if turning else ahead
        seen_n = (1.0 - tile[v, STUCK, lane]) * tile[v, V_NORTH, lane]
        seen_e = (1.0 - tile[v, STUCK + 1, lane]) * tile[v, V_EAST, lane]
        i_x = tile[v, I_X, lane] + gain * (ahead - c * seen_n - s * seen_e)
        i_x = clipped(i_x, INTEGRATOR_LIMIT)
        yaw = tile[v, YAW, lane]
        sp_yaw = tile[v, SP_YAW, lane] if on > 0.0 else yaw
        rate = clipped(HEADING_GAIN * wrapped(sp_yaw - yaw), RATE_LIMIT_RADPS)
        turn = rate * turn_line + scrub * clipped(rate / SCRUB_RATE_RADPS, 1.0)
        tile[v, U_X, lane] = feed_forward(ahead, line, rolling) + i_x
        tile[v, U_Y, lane] = 0.0
        tile[v, U_YAW, lane] = turn + RATE_GAIN * (rate - tile[v, YAW_RATE, lane])
        tile[v, I_X, lane] = on * i_x
        tile[v, SP_YAW, lane] = sp_yaw
        tile[v, LARGEST, lane] = 1.0


@inlined
def accelerate(vehicles: Any, tile: Any, v: int) -> None:
    """Motors, then what the ground takes: it stops a motion, and never reverses it.

    Commands are scaled down together when a motor would saturate.
    """
    dt = vehicles.dt_s
    free = 0.0 if vehicles.yaw_locked else 1.0
    for lane in range(tile.shape[2]):
        c, s = tile[v, COS, lane], tile[v, SIN, lane]
        north, east, rate = tile[v, V_NORTH, lane], tile[v, V_EAST, lane], tile[v, YAW_RATE, lane]
        share = 1.0 / tile[v, LARGEST, lane]
        ux = share * tile[v, U_X, lane]
        uy = share * tile[v, U_Y, lane]
        uyaw = share * tile[v, U_YAW, lane]
        vx, vy = c * north + s * east, c * east - s * north
        step = dt * tile[v, DRIVEN, lane]
        x = step * (dot(tile, v, GIVE, lane, ux, uy, uyaw) - dot(tile, v, DAMP, lane, vx, vy, rate))
        y = step * (
            dot(tile, v, GIVE + 3, lane, ux, uy, uyaw) - dot(tile, v, DAMP + 3, lane, vx, vy, rate)
        )
        yaw = step * (
            dot(tile, v, GIVE + 6, lane, ux, uy, uyaw) - dot(tile, v, DAMP + 6, lane, vx, vy, rate)
        )
        north, east, rate = north + c * x - s * y, east + s * x + c * y, free * (rate + yaw)
        side = -clipped(c * east - s * north, tile[v, SIDE_LOSS, lane])
        north, east = north - s * side, east + c * side
        speed = math.sqrt(north * north + east * east)
        taken = -min(1.0, tile[v, LOSS, lane] / max(speed, TINY))
        scrub = -clipped(rate, tile[v, YAW_LOSS, lane])
        tile[v, HELD_SIDE, lane], tile[v, HELD_YAW, lane] = side, scrub
        tile[v, HELD_N, lane], tile[v, HELD_E, lane] = taken * north, taken * east
        tile[v, V_NORTH, lane], tile[v, V_EAST, lane] = north + taken * north, east + taken * east
        tile[v, YAW_RATE, lane] = rate + scrub


@compiled
def feed_forward(setpoint_mps: float, line: float, rolling: float) -> float:
    """Output that should hold the set-point: the motors' speed line plus rolling resistance."""
    against = math.copysign(rolling, setpoint_mps)
    return setpoint_mps * line + (against if abs(setpoint_mps) >= STANDSTILL_MPS else 0.0)


@compiled
def dot(tile: Any, v: int, column: int, lane: int, x: float, y: float, z: float) -> float:
    result: float = (
        tile[v, column, lane] * x + tile[v, column + 1, lane] * y + tile[v, column + 2, lane] * z
    )
    return result


@compiled
def clipped(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


@compiled
def wrapped(angle_rad: float) -> float:
    """An angle within (-3 pi, 3 pi) in [-pi, pi)."""
    angle_rad = angle_rad - 2.0 * math.pi if angle_rad >= math.pi else angle_rad
    return angle_rad + 2.0 * math.pi if angle_rad < -math.pi else angle_rad
