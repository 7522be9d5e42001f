"""Airframes as data: geometry, motors, mixing, limits; and the forces they make (pure).

Body axes are x forward, y right. A motor output is a number in [-1, 1], or None when the
motor gets no power at all (PWM 0) and its wheel runs free. A rotor has its zero at -1.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

GRAVITY_MPS2 = 9.80665
PWM_NEUTRAL_US = 1500
PWM_SPAN_US = 400  # 1100..1900, ArduPilot's SERVOn_MIN/MAX defaults
PWM_OFF_US = 0
PWM_LOCKED_US = 1  # no autopilot sends it: tells the world that a broken wheel is blocked
UP = (0.0, 0.0)  # the direction of a rotor, seen from above


@dataclass(frozen=True)
class Motor:
    """A driven wheel: where it sits (body, m), which way it pushes (unit vector), how hard.

    A brushed DC motor has a linear torque-speed line: the force is
    `stall_force_n * (output - wheel_speed / free_speed_mps)`. A blocked wheel skids at `grip_n`.
    A rotor pushes UP with at most `stall_force_n`; `spin` is +1 when its drag turns the body
    clockwise, -1 for the other way.
    """

    position_m: tuple[float, float]
    direction: tuple[float, float]
    stall_force_n: float
    free_speed_mps: float
    grip_n: float = 0.0
    spin: int = 0

    @property
    def reversible(self) -> bool:
        return self.direction != UP

    @property
    def zero_us(self) -> int:
        """PWM of no drive."""
        return PWM_NEUTRAL_US if self.reversible else PWM_NEUTRAL_US - PWM_SPAN_US

    @property
    def arm_m(self) -> float:
        """Torque about the vertical axis per newton of force."""
        return self.position_m[0] * self.direction[1] - self.position_m[1] * self.direction[0]


@dataclass(frozen=True)
class Battery:
    """A pack: open-circuit voltage falls linearly with charge. `motor_a` is at full output."""

    capacity_mah: float = 10_000.0
    full_v: float = 25.2
    empty_v: float = 21.0
    resistance_ohm: float = 0.02
    idle_a: float = 0.6
    motor_a: float = 3.0


@dataclass(frozen=True)
class Flight:
    """What an airframe that flies has beyond the others.

    `thrust_expo` bends the thrust curve: thrust over maximum is (1 - e) u + e u^2 for throttle u.
    `drag_torque_m` is a rotor's reaction torque per newton of thrust.
    """

    tilt_inertia_kgm2: float
    tilt_damping_nms: float
    drag_torque_m: float
    thrust_expo: float
    tilt_limit_rad: float
    climb_limit_mps: float
    descent_limit_mps: float
    landing_mps: float


@dataclass(frozen=True)
class Airframe:
    """What a vehicle is, mechanically. `rolling_resistance` is the coefficient c_rr: F = c_rr m g.

    `side_grip` is the friction coefficient of wheels that can't roll sideways. `drag_area_m2` is
    drag coefficient times frontal area; `height_m` is how far up the body can be touched.
    """

    name: str
    radius_m: float
    mass_kg: float
    yaw_inertia_kgm2: float
    rolling_resistance: float
    yaw_resistance_nm: float
    speed_limit_mps: float
    motors: tuple[Motor, ...]
    steering: Literal["omni", "skid", "flight"] = "omni"
    side_grip: float = 0.0
    drag_area_m2: float = 0.0
    height_m: float = 0.3
    battery: Battery = Battery()
    flight: Flight | None = None
    frame_type: int = 0  # ArduPilot's FRAME_TYPE

    @property
    def weight_n(self) -> float:
        return self.mass_kg * GRAVITY_MPS2

    @property
    def rolling_force_n(self) -> float:
        return self.rolling_resistance * self.mass_kg * GRAVITY_MPS2

    @property
    def side_grip_n(self) -> float:
        return self.side_grip * self.weight_n

    def resistance_n(self, axis: str) -> float:
        """What it opposes to a push along body 'x' or 'y' without power."""
        return self.rolling_force_n + (self.side_grip_n if axis == "y" else 0.0)

    def axis_motors(self, axis: str) -> tuple[int, ...]:
        """Instances (from 1) of the motors that drive body 'x' or 'y'."""
        k = {"x": 0, "y": 1}[axis]
        return tuple(i for i, m in enumerate(self.motors, start=1) if abs(m.direction[k]) > 0.5)

    def axis_stall_force_n(self, axis: str) -> float:
        """Force at standstill per unit of body command, as `mix` shares it out."""
        k = {"x": 0, "y": 1}[axis]
        driven = (self.motors[i - 1] for i in self.axis_motors(axis))
        return sum(m.stall_force_n * m.direction[k] * m.direction[k] for m in driven)

    def axis_push_n(self, axis: str) -> float:
        """The largest force at standstill along body 'x' or 'y': all its motors at full output."""
        k = {"x": 0, "y": 1}[axis]
        driven = (self.motors[i - 1] for i in self.axis_motors(axis))
        return sum(m.stall_force_n * abs(m.direction[k]) for m in driven)


def mix(airframe: Airframe, x: float, y: float, yaw: float) -> tuple[float, ...]:
    """Motor outputs for body commands in [-1, 1]; scaled down together when one would saturate."""
    raw = [
        m.direction[0] * x + m.direction[1] * y + yaw * math.copysign(1.0, m.arm_m)
        for m in airframe.motors
    ]
    scale = max(1.0, *(abs(u) for u in raw))
    return tuple(u / scale for u in raw)


def motor_forces(
    airframe: Airframe,
    outputs: Sequence[float | None],
    velocity_body_mps: tuple[float, float],
    yaw_rate_radps: float,
) -> tuple[float, float, float]:
    """Force (N, body x and y) and torque (N m) of all motors; a motor without power gives none."""
    fx = fy = torque = 0.0
    vx, vy = velocity_body_mps
    for motor, output in zip(airframe.motors, outputs, strict=True):
        if output is None:
            continue
        dx, dy = motor.direction
        wheel_mps = dx * vx + dy * vy + motor.arm_m * yaw_rate_radps
        force = motor.stall_force_n * (output - wheel_mps / motor.free_speed_mps)
        fx += force * dx
        fy += force * dy
        torque += force * motor.arm_m
    return fx, fy, torque


def output_to_pwm(output: float | None) -> int:
    """PWM in us as ArduPilot sends it: 1500 is zero drive (electrically braked), 0 is no power."""
    if output is None:
        return PWM_OFF_US
    return round(PWM_NEUTRAL_US + PWM_SPAN_US * max(-1.0, min(1.0, output)))


def pwm_to_output(pwm_us: int) -> float | None:
    """The inverse of `output_to_pwm`; values outside 1100..1900 are clipped."""
    if pwm_us in (PWM_OFF_US, PWM_LOCKED_US):
        return None
    return max(-1.0, min(1.0, (pwm_us - PWM_NEUTRAL_US) / PWM_SPAN_US))


def locked_motors(pwm_us: Sequence[int]) -> frozenset[int]:
    """Places (from 0) of the motors whose wheels are blocked."""
    return frozenset(i for i, pwm in enumerate(pwm_us) if pwm == PWM_LOCKED_US)


def clip_pwm(pwm_us: int) -> int:
    """The nearest PWM that drives: 1100..1900 us."""
    return max(PWM_NEUTRAL_US - PWM_SPAN_US, min(PWM_NEUTRAL_US + PWM_SPAN_US, pwm_us))


def push_margin(airframe: Airframe, pushers: int, pushed: Airframe, axis: str = "y") -> float:
    """What `pushers` rovers can give at crawling speed over what a coasting one resists."""
    give = max(0.0, airframe.axis_push_n(axis) - airframe.rolling_force_n)
    return pushers * give / pushed.resistance_n(axis)
