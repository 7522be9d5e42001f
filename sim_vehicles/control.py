"""Control: set-point and estimate to motor outputs (pure).

The velocity loop is feed-forward with a bounded integrator: with a frozen GPS an unbounded one
would wind up and never unwind. The station's twin copies these equations.

An omni frame follows a velocity set-point sideways without turning; ArduPilot's does not. Other
ways of steering have files of their own; `steer` picks.
"""

import math
from dataclasses import dataclass, replace

from hil.airframe import Airframe, mix
from hil.frames import ned_to_body, wrap_pi
from sim_vehicles.estimator import Estimate

INTEGRATOR_GAIN = 0.5  # output per (m/s) s
INTEGRATOR_LIMIT = 0.1
STANDSTILL_MPS = 0.02  # set-points below this get no feed-forward against rolling resistance
POSITION_GAIN = 0.8  # m/s per m
YAW_GAIN = 2.0  # output per rad
YAW_RATE_GAIN = 0.5  # output per rad/s
YAW_LIMIT = 0.5


@dataclass(frozen=True, slots=True)
class Drive:
    """What the controller knows of an airframe; pairs are body x and y.

    `free_speed_mps` is the speed line of the axis, `rolling_output` what rolling resistance takes.
    """

    airframe: Airframe
    yaw_locked: bool
    free_speed_mps: tuple[float, float]
    rolling_output: tuple[float, float]

    @classmethod
    def of(cls, airframe: Airframe, yaw_locked: bool) -> "Drive":
        axes = ("x", "y")
        free = [_free_speed(airframe, a) for a in axes]
        rolling = [
            airframe.rolling_force_n / (airframe.axis_stall_force_n(a) or math.inf) for a in axes
        ]
        return cls(airframe, yaw_locked, (free[0], free[1]), (rolling[0], rolling[1]))


@dataclass(frozen=True, slots=True)
class Memory:
    """What the controller remembers: an integrator per axis and the heading to hold (rad).

    What flies integrates in NED (m/s2), holds the height `down_m` while it is not told to climb,
    and turns its rotors up only when `airborne`.
    """

    x: float = 0.0
    y: float = 0.0
    yaw_rad: float = 0.0
    z: float = 0.0
    down_m: float | None = None
    airborne: bool = False
    landing: bool = False
    resting_s: float = 0.0

    def afresh(self, yaw_rad: float) -> "Memory":
        """After a change of mode: all forgotten, but for being in the air."""
        return Memory(yaw_rad=yaw_rad, airborne=self.airborne)


def _free_speed(airframe: Airframe, axis: str) -> float:
    driven = airframe.axis_motors(axis)
    return airframe.motors[driven[0] - 1].free_speed_mps if driven else math.inf


def clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def limit_speed(north_mps: float, east_mps: float, limit_mps: float) -> tuple[float, float]:
    """The same direction, no faster than the limit."""
    speed = math.hypot(north_mps, east_mps)
    scale = limit_mps / speed if speed > limit_mps else 1.0
    return north_mps * scale, east_mps * scale


def velocity_towards(
    target_m: tuple[float, float], estimate: Estimate, limit_mps: float
) -> tuple[float, float]:
    """North and east velocity (m/s) that closes in on a point."""
    north = POSITION_GAIN * (target_m[0] - estimate.position_m[0])
    east = POSITION_GAIN * (target_m[1] - estimate.position_m[1])
    return limit_speed(north, east, limit_mps)


def drive_at(
    drive: Drive, memory: Memory, estimate: Estimate, velocity_mps: tuple[float, float], dt_s: float
) -> tuple[tuple[float, ...], Memory]:
    """Motor outputs (-1..1) for a north and east velocity, heading held at `memory.yaw_rad`."""
    yaw = estimate.yaw_rad
    north, east = limit_speed(*velocity_mps, drive.airframe.speed_limit_mps)
    vx, vy = ned_to_body(north, east, yaw)
    seen_x, seen_y = ned_to_body(estimate.velocity_mps[0], estimate.velocity_mps[1], yaw)
    gain = INTEGRATOR_GAIN * dt_s
    ix = clip(memory.x + gain * (vx - seen_x), INTEGRATOR_LIMIT)
    iy = clip(memory.y + gain * (vy - seen_y), INTEGRATOR_LIMIT)
    ux = feed_forward(vx, drive.free_speed_mps[0], drive.rolling_output[0]) + ix
    uy = feed_forward(vy, drive.free_speed_mps[1], drive.rolling_output[1]) + iy
    turn = 0.0
    if not drive.yaw_locked:
        error = wrap_pi(memory.yaw_rad - yaw)
        turn = clip(YAW_GAIN * error - YAW_RATE_GAIN * estimate.gyro_radps[2], YAW_LIMIT)
    return mix(drive.airframe, ux, uy, turn), replace(memory, x=ix, y=iy)


def feed_forward(setpoint_mps: float, free_speed_mps: float, rolling_output: float) -> float:
    """Output that holds a speed: the motors' speed line plus rolling resistance."""
    output = setpoint_mps / free_speed_mps
    if abs(setpoint_mps) < STANDSTILL_MPS:
        return output
    return output + math.copysign(rolling_output, setpoint_mps)
