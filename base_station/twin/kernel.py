"""The twin's dynamics: one deterministic kernel, batched over environments x hypotheses.

A step: autopilot, motors, rolling resistance, contacts (sequential impulses), positions.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import compiled
from base_station.twin.contact import correct_positions, find_contacts, solve_contacts
from base_station.twin.state import (
    DRIVEN,
    EAST,
    I_X,
    I_Y,
    NORTH,
    SP_EAST,
    SP_NORTH,
    SP_YAW,
    V_EAST,
    V_NORTH,
    YAW,
    YAW_RATE,
)

INTEGRATOR_GAIN = 0.5  # output per (m/s) s
INTEGRATOR_LIMIT = 0.1
STANDSTILL_MPS = 0.02  # set-points below this get no feed-forward against rolling resistance
YAW_GAIN = 2.0
YAW_RATE_GAIN = 0.5
YAW_LIMIT = 0.5


@compiled
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
    """`steps` of dt for all rows of `states`, in place; adds to `impulses` and `walls`."""
    rows, count = states.shape[0], states.shape[1]
    draws, hypotheses = parameters.mass_kg.shape[0], faults.power.shape[0]
    inverse = np.empty((count, 2))
    contacts = np.empty((min(count * (count - 1) // 2, 10 * count) + 4 * count, 7))
    for b in range(rows):
        p, h, s = b * draws // rows, b % hypotheses, states[b]
        for v in range(count):
            inverse[v, 0] = 1.0 / parameters.mass_kg[p, v]
            inverse[v, 1] = 0.0 if vehicles.yaw_locked else 1.0 / parameters.inertia_kgm2[p, v]
        delay = round(parameters.latency_s[p] / vehicles.dt_s)
        for k in range(steps):
            if k == delay:
                take_commands(s, setpoints[b], driven[b])
            for v in range(count):
                drive(vehicles, parameters, faults, p, h, v, s[v])
            n = find_contacts(s, vehicles.radius_m, vehicles.bounds_m, contacts)
            if n > 0:
                friction = parameters.friction[p]
                solve_contacts(s, vehicles.radius_m, inverse, friction, vehicles.dt_s, contacts[:n])
                note_contacts(contacts[:n], impulses[b], walls[b])
            for v in range(count):
                s[v, NORTH] += s[v, V_NORTH] * vehicles.dt_s
                s[v, EAST] += s[v, V_EAST] * vehicles.dt_s
                s[v, YAW] = wrapped(s[v, YAW] + s[v, YAW_RATE] * vehicles.dt_s)
            if n > 0:
                correct_positions(s, vehicles.radius_m, vehicles.bounds_m, inverse, contacts[:n])
        if delay >= steps:  # a latency longer than the call is cut to it
            take_commands(s, setpoints[b], driven[b])


@compiled
def take_commands(s: Any, setpoints: Any, driven: Any) -> None:
    """Put the set-points [V, 3] into effect; HOLD (not driven) forgets set-point and integrals."""
    for v in range(s.shape[0]):
        if driven[v]:
            s[v, DRIVEN] = 1.0
            s[v, SP_NORTH] = setpoints[v, 0]
            s[v, SP_EAST] = setpoints[v, 1]
            if not math.isnan(setpoints[v, 2]):
                s[v, SP_YAW] = setpoints[v, 2]
        else:
            s[v, DRIVEN] = 0.0
            s[v, SP_NORTH] = s[v, SP_EAST] = 0.0
            s[v, I_X] = s[v, I_Y] = 0.0


@compiled
def drive(vehicles: Any, parameters: Any, faults: Any, p: int, h: int, v: int, s: Any) -> None:
    """Velocities of one vehicle after a step of its autopilot, motors and rolling resistance."""
    c, sn = math.cos(s[YAW]), math.sin(s[YAW])
    vx = c * s[V_NORTH] + sn * s[V_EAST]
    vy = c * s[V_EAST] - sn * s[V_NORTH]
    mass, inertia, dt = parameters.mass_kg[p, v], parameters.inertia_kgm2[p, v], vehicles.dt_s
    ax = ay = turn = 0.0
    if s[DRIVEN] != 0.0:
        ux, uy, uyaw = autopilot(vehicles, faults.gps_stuck[h, v], v, s, c, sn)
        ax, ay, turn = motors(
            vehicles, parameters.stall_force_n[p, v], faults.power[h, v], v,
            (ux, uy, uyaw), (vx, vy, s[YAW_RATE]), (mass, inertia), dt,
        )  # fmt: skip
    else:
        s[SP_YAW] = s[YAW]
    v_north = s[V_NORTH] + (c * ax - sn * ay) * dt
    v_east = s[V_EAST] + (sn * ax + c * ay) * dt
    keep = slowed(math.hypot(v_north, v_east), parameters.rolling_force_n[p, v] / mass * dt)
    s[V_NORTH], s[V_EAST] = v_north * keep, v_east * keep
    if vehicles.yaw_locked:
        s[YAW_RATE] = 0.0
    else:
        rate = s[YAW_RATE] + turn * dt
        s[YAW_RATE] = rate * slowed(abs(rate), parameters.yaw_resistance_nm[p, v] / inertia * dt)


@compiled
def autopilot(vehicles: Any, stuck: Any, v: int, s: Any, c: float, sn: float) -> Any:
    """Body commands x, y, yaw of the velocity loop; a stuck axis reports no velocity."""
    speed = math.hypot(s[SP_NORTH], s[SP_EAST])
    scale = min(1.0, vehicles.speed_limit_mps[v] / speed) if speed > 0.0 else 1.0
    sp_north, sp_east = s[SP_NORTH] * scale, s[SP_EAST] * scale
    seen_north = 0.0 if stuck[0] else s[V_NORTH]
    seen_east = 0.0 if stuck[1] else s[V_EAST]
    error_n, error_e = sp_north - seen_north, sp_east - seen_east
    gain = INTEGRATOR_GAIN * vehicles.dt_s
    s[I_X] = clipped(s[I_X] + gain * (c * error_n + sn * error_e), INTEGRATOR_LIMIT)
    s[I_Y] = clipped(s[I_Y] + gain * (c * error_e - sn * error_n), INTEGRATOR_LIMIT)
    ux = feed_forward(vehicles, v, 0, c * sp_north + sn * sp_east) + s[I_X]
    uy = feed_forward(vehicles, v, 1, c * sp_east - sn * sp_north) + s[I_Y]
    turn = YAW_GAIN * wrapped(s[SP_YAW] - s[YAW]) - YAW_RATE_GAIN * s[YAW_RATE]
    return ux, uy, 0.0 if vehicles.yaw_locked else clipped(turn, YAW_LIMIT)


@compiled
def feed_forward(vehicles: Any, v: int, axis: int, setpoint_mps: float) -> float:
    """Output that should hold the set-point: the motors' speed line plus rolling resistance."""
    u: float = setpoint_mps / vehicles.axis_free_speed_mps[v, axis]
    if abs(setpoint_mps) >= STANDSTILL_MPS:
        u += math.copysign(vehicles.axis_rolling[v, axis], setpoint_mps)
    return u


@compiled
def motors(
    vehicles: Any, stall: Any, power: Any, v: int, u: Any, velocity: Any, inertia: Any, dt: float
) -> Any:
    """Accelerations (body x, y, yaw) that all motors give together.

    Trapezoidal in the motors' own damping, so that steps of 0.02 s agree with finer ones.
    """
    direction, arm, free = vehicles.direction[v], vehicles.arm_m[v], vehicles.free_speed_mps[v]
    count = arm.shape[0]
    scale = 1.0
    for m in range(count):
        scale = max(scale, abs(mixed(direction[m], arm[m], u)))
    fx = fy = torque = damp_x = damp_y = damp_yaw = 0.0
    for m in range(count):
        if power[m] == 0.0:
            continue
        dx, dy = direction[m, 0], direction[m, 1]
        wheel = dx * velocity[0] + dy * velocity[1] + arm[m] * velocity[2]
        force = stall[m] * (mixed(direction[m], arm[m], u) / scale - wheel / free[m])
        fx += force * dx
        fy += force * dy
        torque += force * arm[m]
        damp_x += stall[m] / free[m] * dx * dx
        damp_y += stall[m] / free[m] * dy * dy
        damp_yaw += stall[m] / free[m] * arm[m] * arm[m]
    mass, yaw_inertia = inertia
    return (
        fx / (mass + 0.5 * dt * damp_x),
        fy / (mass + 0.5 * dt * damp_y),
        torque / (yaw_inertia + 0.5 * dt * damp_yaw),
    )


@compiled
def mixed(direction: Any, arm: float, u: Any) -> float:
    turn = u[2] * (1.0 if arm > 0.0 else -1.0 if arm < 0.0 else 0.0)
    output: float = direction[0] * u[0] + direction[1] * u[1] + turn
    return output


@compiled
def slowed(speed: float, loss: float) -> float:
    """The factor Coulomb resistance leaves of a speed; it never reverses it."""
    return max(0.0, speed - loss) / speed if speed > 0.0 else 0.0


@compiled
def note_contacts(contacts: Any, impulses: Any, walls: Any) -> None:
    """Add normal impulses (N s) to [V, V] if it is wanted (not empty), and mark walls [V]."""
    for k in range(contacts.shape[0]):
        if contacts[k, 5] > 0.0:
            i, j = int(contacts[k, 0]), int(contacts[k, 1])
            if j < 0:
                walls[i] = True
            elif impulses.shape[0] > 0:
                impulses[i, j] += contacts[k, 5]
                impulses[j, i] += contacts[k, 5]


@compiled
def clipped(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


@compiled
def wrapped(angle_rad: float) -> float:
    """The same angle in [-pi, pi)."""
    if -math.pi <= angle_rad < math.pi:
        return angle_rad
    return (angle_rad + math.pi) % (2.0 * math.pi) - math.pi
