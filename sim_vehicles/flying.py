"""Flight: velocity to tilt and thrust, tilt to torques, both to four rotors (pure).

Cascaded as in ArduPilot Copter: velocity -> acceleration -> attitude -> rates. Height is held
while no climb is asked for. Integrators are bounded, as on the ground: a frozen GPS can't wind
them up for long.
"""

import math
from dataclasses import dataclass, replace

from hil.airframe import GRAVITY_MPS2, Airframe, Flight, mix_rotors
from hil.frames import ned_to_body, wrap_pi
from sim_vehicles.control import Drive, Memory, clip, limit_speed
from sim_vehicles.estimator import Estimate
from sim_vehicles.sensors import Vector

VELOCITY_GAIN = 1.2  # m/s2 per m/s, horizontal
CLIMB_GAIN = 3.0  # m/s2 per m/s, vertical
PULL_GAIN, PULL_LIMIT_MPS2 = 0.3, 1.0  # horizontal integrator
LIFT_GAIN, LIFT_LIMIT_MPS2 = 1.0, 2.0  # vertical integrator
HEIGHT_GAIN = 1.0  # m/s per m
TILT_GAIN = 6.0  # rad/s per rad
RATE_GAIN = 15.0  # rad/s2 per rad/s
HEADING_GAIN, HEADING_RATE_RADPS = 2.0, 1.0
TURN_GAIN = 4.0  # rad/s2 per rad/s, about the vertical axis
CLIMB_ASKED_MPS = 0.02
IDLE_SHARE = 0.02  # of the maximum thrust, armed on the ground
LANDED_AFTER_S = 1.0


@dataclass(frozen=True, slots=True)
class Wish:
    """What attitude control shall do: roll and pitch (rad), thrust as a share of the maximum."""

    roll_rad: float
    pitch_rad: float
    thrust: float


def take_off(memory: Memory) -> Memory:
    """From now on the rotors lift. Follow `climb_to` until the height is reached."""
    return replace(memory, airborne=True, resting_s=0.0)


def climb_to(airframe: Airframe, estimate: Estimate, down_m: float) -> float:
    """Down speed (m/s) that goes to a height, given as NED down (m)."""
    return _limited(airframe, HEIGHT_GAIN * (down_m - estimate.position_m[2]))


def landing_speed(airframe: Airframe, height_m: float) -> float:
    """Down speed (m/s) at which to land from a height above the ground."""
    if airframe.flight is None:
        return 0.0
    return max(airframe.flight.landing_mps, _limited(airframe, HEIGHT_GAIN * (height_m - 2.0)))


def land(memory: Memory) -> Memory:
    """From now on it sinks at `landing_speed`, until `has_landed` or a change of mode."""
    return replace(memory, landing=memory.airborne)


def has_landed(memory: Memory) -> bool:
    """It has wanted to sink for a second, and stood still."""
    return memory.resting_s >= LANDED_AFTER_S


def settle(memory: Memory) -> Memory:
    """On the ground: the rotors idle until the next take-off."""
    return Memory(yaw_rad=memory.yaw_rad)


def fly_at(
    drive: Drive, memory: Memory, estimate: Estimate, velocity_mps: Vector, dt_s: float
) -> tuple[tuple[float, ...], Memory]:
    """Rotor outputs (-1..1) for a velocity (NED, m/s), heading held at `memory.yaw_rad`."""
    frame, flight = drive.airframe, drive.airframe.flight
    if flight is None or not memory.airborne:
        return mix_rotors(frame, IDLE_SHARE, 0.0, 0.0, 0.0), memory
    north, east = limit_speed(velocity_mps[0], velocity_mps[1], frame.speed_limit_mps)
    down, memory = _sinking(frame, memory, estimate, velocity_mps[2])
    wish, memory = _wish(frame, flight, memory, estimate, (north, east, down), dt_s)
    resting = down >= 0.2 and abs(estimate.velocity_mps[2]) < 0.1
    memory = replace(memory, resting_s=memory.resting_s + dt_s if resting else 0.0)
    return mix_rotors(frame, wish.thrust, *turns(drive, flight, memory, estimate, wish)), memory


def _sinking(
    frame: Airframe, memory: Memory, estimate: Estimate, asked_mps: float
) -> tuple[float, Memory]:
    """Down speed to fly: as asked, or what holds the height at which nothing was asked."""
    if abs(asked_mps) > CLIMB_ASKED_MPS:
        return _limited(frame, asked_mps), replace(memory, down_m=None)
    held_m = estimate.position_m[2] if memory.down_m is None else memory.down_m
    return climb_to(frame, estimate, held_m), replace(memory, down_m=held_m)


def _wish(
    frame: Airframe,
    flight: Flight,
    memory: Memory,
    estimate: Estimate,
    velocity_mps: Vector,
    dt_s: float,
) -> tuple[Wish, Memory]:
    n, e, d = (v - seen for v, seen in zip(velocity_mps, estimate.velocity_mps, strict=True))
    memory = replace(
        memory,
        x=clip(memory.x + PULL_GAIN * dt_s * n, PULL_LIMIT_MPS2),
        y=clip(memory.y + PULL_GAIN * dt_s * e, PULL_LIMIT_MPS2),
        z=clip(memory.z + LIFT_GAIN * dt_s * d, LIFT_LIMIT_MPS2),
    )
    most = GRAVITY_MPS2 * math.tan(flight.tilt_limit_rad)
    pull = limit_speed(VELOCITY_GAIN * n + memory.x, VELOCITY_GAIN * e + memory.y, most)
    ahead, right = ned_to_body(*pull, estimate.yaw_rad)
    lift_n = frame.mass_kg * (GRAVITY_MPS2 - CLIMB_GAIN * d - memory.z)
    upright = max(0.5, math.cos(estimate.roll_rad) * math.cos(estimate.pitch_rad))
    share = lift_n / upright / sum(m.stall_force_n for m in frame.motors)
    tilt = math.atan2(right, GRAVITY_MPS2), -math.atan2(ahead, GRAVITY_MPS2)
    return Wish(*tilt, max(IDLE_SHARE, min(1.0, share))), memory


def turns(
    drive: Drive, flight: Flight, memory: Memory, estimate: Estimate, wish: Wish
) -> tuple[float, float, float]:
    """Roll, pitch and yaw moments as shares of the maximum thrust of a rotor."""
    p, q, r = estimate.gyro_radps
    all_n = sum(m.stall_force_n for m in drive.airframe.motors)
    arm_m = abs(drive.airframe.motors[0].position_m[1])
    tilt = flight.tilt_inertia_kgm2 * RATE_GAIN / (all_n * arm_m)
    roll = tilt * (TILT_GAIN * (wish.roll_rad - estimate.roll_rad) - p)
    pitch = tilt * (TILT_GAIN * (wish.pitch_rad - estimate.pitch_rad) - q)
    if drive.yaw_locked:
        return roll, pitch, 0.0
    error = wrap_pi(memory.yaw_rad - estimate.yaw_rad)
    wanted = clip(HEADING_GAIN * error, HEADING_RATE_RADPS) - r
    turn = drive.airframe.yaw_inertia_kgm2 * TURN_GAIN / (all_n * flight.drag_torque_m)
    return roll, pitch, clip(turn * wanted, 0.1)


def _limited(frame: Airframe, down_mps: float) -> float:
    if frame.flight is None:
        return 0.0
    return max(-frame.flight.climb_limit_mps, min(frame.flight.descent_limit_mps, down_mps))
