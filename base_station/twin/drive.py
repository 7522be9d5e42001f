"""One step of a vehicle's autopilot, motors and ground, for all lanes of a tile.

The autopilot's equations are those of the simulated vehicles: a velocity loop that is
feed-forward with a bounded integrator; a skid-steered frame turns towards its velocity. Those of
heading-first autopilots are ArduPilot's.
"""

import math
from typing import Any

from base_station.twin.compiled import compiled, inlined
from base_station.twin.lanes import least, magnitude, most, put, root, signed, take, where
from base_station.twin.state import (
    AHEAD,
    DRIVEN,
    I_X,
    I_Y,
    SP_EAST,
    SP_NORTH,
    SP_YAW,
    THROTTLE,
    TURN,
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
    LOSS,
    SIDE_LOSS,
    SIN,
    STUCK,
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

# columns of `helm`, as in HeadingFirst
SPEED_FF, SPEED_P, SPEED_I, ACCEL, SLEW, STOP = range(6)
HEADING_P, RATE_MAX, TURN_ACCEL, RATE_FF, RATE_P, RATE_I = range(6, 12)


@compiled
def take_commands(vehicles: Any, tile: Any, lane: int, setpoints: Any, driven: Any, b: int) -> None:
    """Put row b of set-points [B, V, 3] into effect; HOLD (not driven [B, V]) forgets set-point
    and integrals."""
    for v in range(tile.shape[0] - 1):
        north = east = 0.0
        tile[v, DRIVEN, lane] = driven[b, v]
        if driven[b, v]:
            north, east, yaw = setpoints[b, v, 0], setpoints[b, v, 1], setpoints[b, v, 2]
            speed = math.sqrt(north * north + east * east)
            share = min(1.0, vehicles.speed_limit_mps[v] / max(speed, TINY))
            north, east = north * share, east * share
            if vehicles.heading_first[v]:
                if not math.isnan(yaw):
                    tile[v, SP_YAW, lane] = yaw
                elif speed >= STANDSTILL_MPS:
                    tile[v, SP_YAW, lane] = math.atan2(east, north)
                else:  # told to stand: it does not turn on
                    tile[v, SP_YAW, lane] = tile[v, YAW, lane]
                along = tile[v, SP_YAW, lane]
                north, east = math.cos(along) * north + math.sin(along) * east, 0.0
            elif vehicles.skid[v] and speed * share >= TURNING_MPS:
                tile[v, SP_YAW, lane] = math.atan2(east, north)
            elif not math.isnan(yaw):
                tile[v, SP_YAW, lane] = yaw
        else:
            tile[v, I_X, lane] = tile[v, I_Y, lane] = 0.0
        tile[v, SP_NORTH, lane], tile[v, SP_EAST, lane] = north, east


@inlined
def drive(vehicles: Any, tile: Any, v: int, locked: bool) -> None:
    if vehicles.heading_first[v]:
        ux, uy, uyaw = heading_first_commands(vehicles, tile, v)
    elif vehicles.skid[v]:
        ux, uy, uyaw = skid_commands(vehicles, tile, v)
    else:
        ux, uy, uyaw = omni_commands(vehicles, tile, v, locked)
    largest = 0.0 * ux + 1.0
    for m in range(vehicles.arm_m.shape[1]):
        output = vehicles.mix[v, m, 0] * ux + vehicles.mix[v, m, 1] * uy
        if not locked:
            output = output + vehicles.mix[v, m, 2] * uyaw
        largest = most(largest, magnitude(output))
    share = 1.0 / largest
    accelerate(vehicles, tile, v, share * ux, share * uy, share * uyaw, locked)


@inlined
def omni_commands(vehicles: Any, tile: Any, v: int, locked: bool) -> Any:
    """Body commands of the velocity loop; a stuck axis reports no velocity."""
    gain = INTEGRATOR_GAIN * vehicles.dt_s
    x_line, x_rolling = 1.0 / vehicles.axis_free_speed_mps[v, 0], vehicles.axis_rolling[v, 0]
    y_line, y_rolling = 1.0 / vehicles.axis_free_speed_mps[v, 1], vehicles.axis_rolling[v, 1]
    c, s, on = take(tile, v, COS), take(tile, v, SIN), take(tile, v, DRIVEN)
    sp_n, sp_e = take(tile, v, SP_NORTH), take(tile, v, SP_EAST)
    error_n = sp_n - (1.0 - take(tile, v, STUCK)) * take(tile, v, V_NORTH)
    error_e = sp_e - (1.0 - take(tile, v, STUCK + 1)) * take(tile, v, V_EAST)
    i_x = clipped(take(tile, v, I_X) + gain * (c * error_n + s * error_e), INTEGRATOR_LIMIT)
    i_y = clipped(take(tile, v, I_Y) + gain * (c * error_e - s * error_n), INTEGRATOR_LIMIT)
    put(tile, v, I_X, on * i_x)
    put(tile, v, I_Y, on * i_y)
    turn = 0.0 * on
    if not locked:
        yaw = take(tile, v, YAW)
        sp_yaw = where(on > 0.0, take(tile, v, SP_YAW), yaw)
        put(tile, v, SP_YAW, sp_yaw)
        swing = YAW_RATE_GAIN * take(tile, v, YAW_RATE)
        turn = clipped(YAW_GAIN * wrapped(sp_yaw - yaw) - swing, YAW_LIMIT)
        turn = (0.0 if vehicles.yaw_locked else 1.0) * turn
    ux = feed_forward(c * sp_n + s * sp_e, x_line, x_rolling) + i_x
    uy = feed_forward(c * sp_e - s * sp_n, y_line, y_rolling) + i_y
    return ux, uy, turn


@inlined
def skid_commands(vehicles: Any, tile: Any, v: int) -> Any:
    """Turn towards the velocity, and drive as much of it as lies ahead."""
    gain = INTEGRATOR_GAIN * vehicles.dt_s
    line, rolling = 1.0 / vehicles.axis_free_speed_mps[v, 0], vehicles.axis_rolling[v, 0]
    c, s, on = take(tile, v, COS), take(tile, v, SIN), take(tile, v, DRIVEN)
    sp_n, sp_e = take(tile, v, SP_NORTH), take(tile, v, SP_EAST)
    ahead = c * sp_n + s * sp_e
    turning = sp_n * sp_n + sp_e * sp_e >= TURNING_MPS * TURNING_MPS
    ahead = where(turning, most(0.0, ahead), ahead)
    seen_n = (1.0 - take(tile, v, STUCK)) * take(tile, v, V_NORTH)
    seen_e = (1.0 - take(tile, v, STUCK + 1)) * take(tile, v, V_EAST)
    i_x = take(tile, v, I_X) + gain * (ahead - c * seen_n - s * seen_e)
    i_x = clipped(i_x, INTEGRATOR_LIMIT)
    put(tile, v, I_X, on * i_x)
    yaw = take(tile, v, YAW)
    sp_yaw = where(on > 0.0, take(tile, v, SP_YAW), yaw)
    put(tile, v, SP_YAW, sp_yaw)
    rate = clipped(HEADING_GAIN * wrapped(sp_yaw - yaw), RATE_LIMIT_RADPS)
    scrub = vehicles.turn_scrub[v] * clipped(rate / SCRUB_RATE_RADPS, 1.0)
    turn = rate * vehicles.turn_line[v] + scrub
    turn = turn + RATE_GAIN * (rate - take(tile, v, YAW_RATE))
    return feed_forward(ahead, line, rolling) + i_x, 0.0 * on, turn


@inlined
def heading_first_commands(vehicles: Any, tile: Any, v: int) -> Any:
    """Speed and heading loops apart: the whole speed along the nose, wherever that points.

    As ArduPilot's rover in GUIDED, and in HOLD, where its throttle slews to zero and brakes.
    """
    helm, dt = vehicles.helm[v], vehicles.dt_s
    c, s, on = take(tile, v, COS), take(tile, v, SIN), take(tile, v, DRIVEN)
    before = take(tile, v, AHEAD)
    ahead = before + clipped(on * take(tile, v, SP_NORTH) - before, helm[ACCEL] * dt)
    put(tile, v, AHEAD, on * ahead)
    seen_n = (1.0 - take(tile, v, STUCK)) * take(tile, v, V_NORTH)
    seen_e = (1.0 - take(tile, v, STUCK + 1)) * take(tile, v, V_EAST)
    seen = c * seen_n + s * seen_e
    asked = where(magnitude(ahead) > 0.0, 1.0, 0.0)
    rolls = where(magnitude(seen) >= helm[STOP], 1.0, 0.0)
    moving = on * most(asked, rolls)
    throttle, i_x, error = take(tile, v, THROTTLE), take(tile, v, I_X), ahead - seen
    wanted = helm[SPEED_FF] * ahead + helm[SPEED_P] * error
    grown = helm[SPEED_I] * dt * error
    slews = magnitude(clipped(wanted + i_x, 1.0) - throttle) > helm[SLEW] * dt
    held = where(slews, 0.0 * on, grown)  # while the throttle can't follow, it may only shrink
    i_x = moving * clipped(i_x + where(error * i_x < 0.0, grown, held), 1.0)
    put(tile, v, I_X, i_x)
    wanted = moving * (wanted + i_x)
    throttle = throttle + clipped(clipped(wanted, 1.0) - throttle, helm[SLEW] * dt)
    put(tile, v, THROTTLE, throttle)
    yaw, rate = take(tile, v, YAW), take(tile, v, YAW_RATE)
    sp_yaw = where(on > 0.0, take(tile, v, SP_YAW), yaw)
    put(tile, v, SP_YAW, sp_yaw)
    error = wrapped(sp_yaw - yaw)
    turn = clipped(helm[HEADING_P] * error, helm[RATE_MAX])
    turn = clipped(turn, root(2.0 * helm[TURN_ACCEL] * magnitude(error)))
    before = take(tile, v, TURN)
    turn = on * (before + clipped(turn - before, helm[TURN_ACCEL] * dt))
    put(tile, v, TURN, turn)
    i_yaw = on * clipped(take(tile, v, I_Y) + helm[RATE_I] * dt * (turn - rate), 1.0)
    put(tile, v, I_Y, i_yaw)
    steer = helm[RATE_FF] * turn + on * helm[RATE_P] * (turn - rate) + i_yaw
    return throttle, 0.0 * on, steer


@inlined
def accelerate(vehicles: Any, tile: Any, v: int, ux: Any, uy: Any, uyaw: Any, locked: bool) -> None:
    """Motors, then what the ground takes: it stops a motion, and never reverses it."""
    c, s = take(tile, v, COS), take(tile, v, SIN)
    north, east = take(tile, v, V_NORTH), take(tile, v, V_EAST)
    vx, vy = c * north + s * east, c * east - s * north
    brakes = 1.0 if vehicles.heading_first[v] else 0.0  # in HOLD, too
    step = vehicles.dt_s * most(brakes, take(tile, v, DRIVEN))
    x = gained(tile, v, 0, ux, uy, vx, vy)
    y = gained(tile, v, 1, ux, uy, vx, vy)
    if not locked:
        rate = take(tile, v, YAW_RATE)
        x = x + (take(tile, v, GIVE + 2) * uyaw - take(tile, v, DAMP + 2) * rate)
        y = y + (take(tile, v, GIVE + 5) * uyaw - take(tile, v, DAMP + 5) * rate)
        yaw = gained(tile, v, 2, ux, uy, vx, vy)
        yaw = yaw + (take(tile, v, GIVE + 8) * uyaw - take(tile, v, DAMP + 8) * rate)
        rate = (0.0 if vehicles.yaw_locked else 1.0) * (rate + step * yaw)
        scrub = -clipped(rate, take(tile, v, YAW_LOSS))
        put(tile, v, HELD_YAW, scrub)
        put(tile, v, YAW_RATE, rate + scrub)
    x, y = step * x, step * y
    north, east = north + c * x - s * y, east + s * x + c * y
    if vehicles.grips[v]:
        side = -clipped(c * east - s * north, take(tile, v, SIDE_LOSS))
        put(tile, v, HELD_SIDE, side)
        north, east = north - s * side, east + c * side
    speed = root(north * north + east * east)
    taken = -least(1.0, take(tile, v, LOSS) / most(speed, TINY))
    put(tile, v, HELD_N, taken * north)
    put(tile, v, HELD_E, taken * east)
    put(tile, v, V_NORTH, north + taken * north)
    put(tile, v, V_EAST, east + taken * east)


@inlined
def gained(tile: Any, v: int, i: int, ux: Any, uy: Any, vx: Any, vy: Any) -> Any:
    """Acceleration along body axis i by commands and velocities of x and y."""
    give, damp = GIVE + 3 * i, DAMP + 3 * i
    given = take(tile, v, give) * ux + take(tile, v, give + 1) * uy
    return given - (take(tile, v, damp) * vx + take(tile, v, damp + 1) * vy)


@inlined
def feed_forward(setpoint_mps: Any, line: float, rolling: float) -> Any:
    """Output that should hold the set-point: the motors' speed line plus rolling resistance."""
    against = signed(rolling, setpoint_mps)
    moving = magnitude(setpoint_mps) >= STANDSTILL_MPS
    return setpoint_mps * line + where(moving, against, 0.0)


@inlined
def clipped(value: Any, limit: Any) -> Any:
    return most(-limit, least(limit, value))


@inlined
def wrapped(angle_rad: Any) -> Any:
    """An angle within (-3 pi, 3 pi) in [-pi, pi)."""
    angle_rad = where(angle_rad >= math.pi, angle_rad - 2.0 * math.pi, angle_rad)
    return where(angle_rad < -math.pi, angle_rad + 2.0 * math.pi, angle_rad)
