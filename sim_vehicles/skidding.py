"""Skid-steer: turn towards the velocity, and drive as much of it as lies ahead (pure).

As ArduPilot's skid-steered rover does in GUIDED. Speeds too small to turn for are driven as far
as they lie along the body; the heading is held then.
"""

import math
from dataclasses import replace

from hil.airframe import Airframe, mix
from hil.frames import ned_to_body, wrap_pi
from sim_vehicles.control import (
    INTEGRATOR_GAIN,
    INTEGRATOR_LIMIT,
    Drive,
    Memory,
    clip,
    feed_forward,
    limit_speed,
)
from sim_vehicles.estimator import Estimate

TURNING_MPS = 0.1  # slower set-points don't turn it
HEADING_GAIN = 2.0  # rad/s per rad
RATE_LIMIT_RADPS = 1.5
RATE_GAIN = 0.3  # output per rad/s
SCRUB_RATE_RADPS = 0.05  # set-point from which on scrub is fully fed forward


def skid_at(
    drive: Drive, memory: Memory, estimate: Estimate, velocity_mps: tuple[float, float], dt_s: float
) -> tuple[tuple[float, ...], Memory]:
    """Motor outputs (-1..1) for a north and east velocity; standing, it turns to `yaw_rad`."""
    north, east = limit_speed(*velocity_mps, drive.airframe.speed_limit_mps)
    if math.hypot(north, east) >= TURNING_MPS:
        memory = replace(memory, yaw_rad=math.atan2(east, north))
    error = wrap_pi(memory.yaw_rad - estimate.yaw_rad)
    ahead, _ = ned_to_body(north, east, estimate.yaw_rad)
    if math.hypot(north, east) >= TURNING_MPS:
        ahead = max(0.0, ahead)
    seen, _ = ned_to_body(estimate.velocity_mps[0], estimate.velocity_mps[1], estimate.yaw_rad)
    i = clip(memory.x + INTEGRATOR_GAIN * dt_s * (ahead - seen), INTEGRATOR_LIMIT)
    forward = feed_forward(ahead, drive.free_speed_mps[0], drive.rolling_output[0]) + i
    rate = clip(HEADING_GAIN * error, RATE_LIMIT_RADPS)
    turn = turn_output(drive.airframe, rate) + RATE_GAIN * (rate - estimate.gyro_radps[2])
    return mix(drive.airframe, forward, 0.0, turn), replace(memory, x=i)


def turn_output(airframe: Airframe, rate_radps: float) -> float:
    """Output of each side that holds a turn rate: the motors' speed line plus scrub."""
    stall_nm = sum(m.stall_force_n * abs(m.arm_m) for m in airframe.motors)
    wheel_mps = rate_radps * abs(airframe.motors[0].arm_m)
    scrub = airframe.yaw_resistance_nm / stall_nm * clip(rate_radps / SCRUB_RATE_RADPS, 1.0)
    return wheel_mps / airframe.motors[0].free_speed_mps + scrub
