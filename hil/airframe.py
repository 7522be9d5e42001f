"""Airframes as data: geometry, motors, mixing, limits; and the forces they make (pure).

Body axes are x forward, y right. A motor output is a number in [-1, 1], or None when the
motor gets no power at all (PWM 0) and its wheel runs free.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

GRAVITY_MPS2 = 9.80665
PWM_NEUTRAL_US = 1500
PWM_SPAN_US = 400  # 1100..1900, ArduPilot's SERVOn_MIN/MAX defaults
PWM_OFF_US = 0


@dataclass(frozen=True)
class Motor:
    """A driven wheel: where it sits (body, m), which way it pushes (unit vector), how hard.

    A brushed DC motor has a linear torque-speed line: the force is
    `stall_force_n * (output - wheel_speed / free_speed_mps)`.
    """

    position_m: tuple[float, float]
    direction: tuple[float, float]
    stall_force_n: float
    free_speed_mps: float

    @property
    def arm_m(self) -> float:
        """Torque about the vertical axis per newton of force."""
        return self.position_m[0] * self.direction[1] - self.position_m[1] * self.direction[0]


@dataclass(frozen=True)
class Airframe:
    """What a vehicle is, mechanically. `rolling_resistance` is the coefficient c_rr: F = c_rr m g."""

    name: str
    radius_m: float
    mass_kg: float
    yaw_inertia_kgm2: float
    rolling_resistance: float
    yaw_resistance_nm: float
    speed_limit_mps: float
    motors: tuple[Motor, ...]

    @property
    def rolling_force_n(self) -> float:
        return self.rolling_resistance * self.mass_kg * GRAVITY_MPS2

    def axis_motors(self, axis: str) -> tuple[int, ...]:
        """Instances (from 1) of the motors that drive body 'x' or 'y'."""
        k = {"x": 0, "y": 1}[axis]
        return tuple(i for i, m in enumerate(self.motors, start=1) if abs(m.direction[k]) > 0.5)

    def axis_stall_force_n(self, axis: str) -> float:
        return sum(self.motors[i - 1].stall_force_n for i in self.axis_motors(axis))


def mix(airframe: Airframe, x: float, y: float, yaw: float) -> tuple[float, ...]:
    """Motor outputs for body commands in [-1, 1]; scaled down together when one would saturate."""
    raw = [
        m.direction[0] * x + m.direction[1] * y + math.copysign(yaw, m.arm_m) for m in airframe.motors
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
    if pwm_us == PWM_OFF_US:
        return None
    return max(-1.0, min(1.0, (pwm_us - PWM_NEUTRAL_US) / PWM_SPAN_US))


def push_margin(airframe: Airframe, pushers: int, pushed: Airframe, axis: str = "y") -> float:
    """What `pushers` rovers can give at crawling speed over what a coasting one resists."""
    give = airframe.axis_stall_force_n(axis) - airframe.rolling_force_n
    return pushers * give / pushed.rolling_force_n


def _omni(name: str, directions: Sequence[tuple[float, float]]) -> Airframe:
    """Four omni wheels at 0.2 m: left, right, front, rear. An 8 kg research rover.

    16 N of stall force a wheel and 1.6 m/s free speed give a time constant of 0.4 s and 3 m/s2
    at standstill; c_rr = 0.1 is a small rubber wheel on grass (Bekker-type tables give 0.05-0.15).
    """
    places = ((0.0, -0.2), (0.0, 0.2), (0.2, 0.0), (-0.2, 0.0))
    motors = tuple(Motor(p, d, 16.0, 1.6) for p, d in zip(places, directions, strict=True))
    return Airframe(name, 0.3, 8.0, 0.36, 0.10, 0.6, 1.0, motors)


OMNI_PLUS = _omni("omni_plus", ((1.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.0, 1.0)))

AIRFRAMES = {a.name: a for a in (OMNI_PLUS,)}
