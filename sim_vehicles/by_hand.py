"""Flying by hand, as ArduPilot Copter's STABILIZE: sticks to tilt, thrust and turn (pure)."""

import math
from dataclasses import replace

from hil.airframe import mix_rotors
from hil.frames import wrap_pi
from sim_vehicles.control import Drive, Memory, limit_speed
from sim_vehicles.estimator import Estimate
from sim_vehicles.flying import (
    HEADING_RATE_RADPS,
    IDLE_SHARE,
    Wish,
    has_landed,
    settle,
    take_off,
    turns,
)
from sim_vehicles.services.piloting import Sticks

BOTTOM = -0.9  # a throttle stick below this means the ground


def fly_by_hand(
    drive: Drive, memory: Memory, estimate: Estimate, sticks: Sticks, dt_s: float
) -> tuple[tuple[float, ...], Memory]:
    """Rotor outputs (-1..1). A full stick tilts to the airframe's limit, or turns at 1 rad/s.

    Thrust is the throttle stick's: none at the bottom, the weight in the middle, all at the top. It
    grows with the tilt, so that height is kept (ATC_ANGLE_BOOST). Raising the stick takes off; at
    the bottom, and after standing still for a second, it has landed.
    """
    frame, flight = drive.airframe, drive.airframe.flight
    if flight is None or not (memory.airborne or sticks.throttle > BOTTOM):
        return mix_rotors(frame, IDLE_SHARE, 0.0, 0.0, 0.0), memory
    memory = memory if memory.airborne else take_off(memory)
    yaw_rad = wrap_pi(memory.yaw_rad + sticks.steering * HEADING_RATE_RADPS * dt_s)
    resting = sticks.throttle <= BOTTOM and abs(estimate.velocity_mps[2]) < 0.1
    resting_s = memory.resting_s + dt_s if resting else 0.0
    memory = replace(memory, yaw_rad=yaw_rad, resting_s=resting_s)
    if has_landed(memory):
        return mix_rotors(frame, IDLE_SHARE, 0.0, 0.0, 0.0), settle(memory)
    most = flight.tilt_limit_rad
    roll, forward = limit_speed(most * sticks.lateral, most * sticks.ahead, most)
    wish = Wish(roll, -forward, _thrust(drive, sticks.throttle, estimate))
    return mix_rotors(frame, wish.thrust, *turns(drive, flight, memory, estimate, wish)), memory


def _thrust(drive: Drive, throttle: float, estimate: Estimate) -> float:
    """As a share of the maximum."""
    hover = drive.airframe.weight_n / sum(m.stall_force_n for m in drive.airframe.motors)
    share = hover * (1.0 + throttle) if throttle <= 0.0 else hover + (1.0 - hover) * throttle
    upright = max(0.5, math.cos(estimate.roll_rad) * math.cos(estimate.pitch_rad))
    return max(IDLE_SHARE, min(1.0, share / upright))
