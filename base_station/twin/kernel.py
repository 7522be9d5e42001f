"""The twin's dynamics: one deterministic kernel, batched over environments x hypotheses.

A step: autopilot, motors, rolling resistance, contacts (sequential impulses), positions.
"""

import math
from typing import Any

import numpy as np

from base_station.twin.compiled import cached, compiled, sources
from base_station.twin.contact import correct_positions, find_contacts, solve_contacts
from base_station.twin.lump import (
    DAMP,
    GIVE,
    LOSS,
    MIX,
    PER_SPEED,
    ROLLING,
    SPEED_LIMIT,
    STUCK,
    YAW_LOSS,
    columns,
    lump,
)
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
) -> None:
    """`steps` of dt for all rows of `states`, in place; adds to `impulses` and `walls`."""
    rows, count = states.shape[0], states.shape[1]
    draws, hypotheses = parameters.mass_kg.shape[0], faults.power.shape[0]
    dt, radius, bounds = vehicles.dt_s, vehicles.radius_m, vehicles.bounds_m
    locked, motors = vehicles.yaw_locked, vehicles.arm_m.shape[1]
    k = np.empty((count, columns(motors)))
    contacts = np.empty((min(count * (count - 1) // 2, 10 * count) + 4 * count, 7))
    for b in range(rows):
        p, s = b * draws // rows, states[b]
        lump(vehicles, parameters, faults, p, b % hypotheses, k)
        delay = round(parameters.latency_s[p] / dt)
        for step in range(steps):
            if step == delay:
                take_commands(s, setpoints[b], driven[b])
            for v in range(count):
                drive(k, motors, locked, dt, v, s)
            n = find_contacts(s, radius, bounds, contacts)
            if n > 0:
                solve_contacts(s, radius, k, parameters.friction[p], dt, contacts, n)
                note_contacts(contacts, n, impulses[b], walls[b])
            for v in range(count):
                s[v, NORTH] += s[v, V_NORTH] * dt
                s[v, EAST] += s[v, V_EAST] * dt
                s[v, YAW] = wrapped(s[v, YAW] + s[v, YAW_RATE] * dt)
            if n > 0:
                correct_positions(s, radius, bounds, k, contacts, n)
        if delay >= steps:  # a latency longer than the call is cut to it
            take_commands(s, setpoints[b], driven[b])


@compiled
def take_commands(s: Any, setpoints: Any, driven: Any) -> None:
    """Put set-points [V, 3] into effect; HOLD (not driven) forgets set-point and integrals."""
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
def drive(k: Any, motors: int, locked: bool, dt: float, v: int, s: Any) -> None:
    """Velocities of one vehicle after a step of its autopilot, motors and rolling resistance."""
    north, east, rate = s[v, V_NORTH], s[v, V_EAST], s[v, YAW_RATE]
    if s[v, DRIVEN] != 0.0:
        c, sn = math.cos(s[v, YAW]), math.sin(s[v, YAW])
        ux, uy, uyaw = autopilot(k, motors, locked, dt, v, s, c, sn)
        vx, vy = c * north + sn * east, c * east - sn * north
        ax = dot(k, v, GIVE, ux, uy, uyaw) - dot(k, v, DAMP, vx, vy, rate)
        ay = dot(k, v, GIVE + 3, ux, uy, uyaw) - dot(k, v, DAMP + 3, vx, vy, rate)
        north += (c * ax - sn * ay) * dt
        east += (sn * ax + c * ay) * dt
        rate += (dot(k, v, GIVE + 6, ux, uy, uyaw) - dot(k, v, DAMP + 6, vx, vy, rate)) * dt
    else:
        s[v, SP_YAW] = s[v, YAW]
    keep = kept(math.sqrt(north * north + east * east), k[v, LOSS])
    s[v, V_NORTH], s[v, V_EAST] = north * keep, east * keep
    s[v, YAW_RATE] = 0.0 if locked else rate * kept(abs(rate), k[v, YAW_LOSS])


@compiled
def autopilot(
    k: Any, motors: int, locked: bool, dt: float, v: int, s: Any, c: float, sn: float
) -> Any:
    """Body commands x, y, yaw of the velocity loop; a stuck axis reports no velocity.

    Scaled down together when a motor would saturate.
    """
    sp_north, sp_east = s[v, SP_NORTH], s[v, SP_EAST]
    speed = math.sqrt(sp_north * sp_north + sp_east * sp_east)
    if speed > k[v, SPEED_LIMIT]:
        sp_north *= k[v, SPEED_LIMIT] / speed
        sp_east *= k[v, SPEED_LIMIT] / speed
    error_n = sp_north if k[v, STUCK] != 0.0 else sp_north - s[v, V_NORTH]
    error_e = sp_east if k[v, STUCK + 1] != 0.0 else sp_east - s[v, V_EAST]
    gain = INTEGRATOR_GAIN * dt
    s[v, I_X] = clipped(s[v, I_X] + gain * (c * error_n + sn * error_e), INTEGRATOR_LIMIT)
    s[v, I_Y] = clipped(s[v, I_Y] + gain * (c * error_e - sn * error_n), INTEGRATOR_LIMIT)
    ux = feed_forward(k, v, 0, c * sp_north + sn * sp_east) + s[v, I_X]
    uy = feed_forward(k, v, 1, c * sp_east - sn * sp_north) + s[v, I_Y]
    uyaw = 0.0
    if not locked:
        turn = YAW_GAIN * wrapped(s[v, SP_YAW] - s[v, YAW]) - YAW_RATE_GAIN * s[v, YAW_RATE]
        uyaw = clipped(turn, YAW_LIMIT)
    largest = 1.0
    for m in range(motors):
        largest = max(largest, abs(dot(k, v, MIX + 3 * m, ux, uy, uyaw)))
    return ux / largest, uy / largest, uyaw / largest


@compiled
def feed_forward(k: Any, v: int, axis: int, setpoint_mps: float) -> float:
    """Output that should hold the set-point: the motors' speed line plus rolling resistance."""
    u: float = setpoint_mps * k[v, PER_SPEED + axis]
    if abs(setpoint_mps) >= STANDSTILL_MPS:
        u += math.copysign(k[v, ROLLING + axis], setpoint_mps)
    return u


@compiled
def dot(k: Any, v: int, column: int, x: float, y: float, z: float) -> float:
    result: float = k[v, column] * x + k[v, column + 1] * y + k[v, column + 2] * z
    return result


@compiled
def kept(speed: float, loss: float) -> float:
    """The factor that Coulomb resistance leaves of a speed; it never reverses it."""
    return (speed - loss) / speed if speed > loss else 0.0


@compiled
def note_contacts(contacts: Any, n: int, impulses: Any, walls: Any) -> None:
    """Add normal impulses (N s) to [V, V] if it is wanted (not empty), and mark walls [V]."""
    for k in range(n):
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


def _entry(version: int) -> Any:
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
                vehicles, parameters, faults, states, setpoints, driven, steps, impulses, walls
            )

    return cached(advance_rows)


advance_rows = _entry(sources())
