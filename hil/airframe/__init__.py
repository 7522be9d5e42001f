"""Airframes as data: one file each, and here by name. A new one needs a file and a line below."""

from hil.airframe.model import (
    GRAVITY_MPS2,
    PWM_LOCKED_US,
    PWM_NEUTRAL_US,
    PWM_OFF_US,
    PWM_SPAN_US,
    UP,
    Airframe,
    Battery,
    Flight,
    Motor,
    clip_pwm,
    locked_motors,
    mix,
    motor_forces,
    output_to_pwm,
    push_margin,
    pwm_to_output,
)
from hil.airframe.omni import OMNI_PLUS, OMNI_X
from hil.airframe.quad import QUAD_X
from hil.airframe.rotors import Lift, lift, mix_rotors, throttle_for
from hil.airframe.skid import SKID_STEER

AIRFRAMES = {a.name: a for a in (OMNI_PLUS, OMNI_X, SKID_STEER, QUAD_X)}

__all__ = [
    "AIRFRAMES",
    "GRAVITY_MPS2",
    "OMNI_PLUS",
    "OMNI_X",
    "PWM_LOCKED_US",
    "PWM_NEUTRAL_US",
    "PWM_OFF_US",
    "PWM_SPAN_US",
    "QUAD_X",
    "SKID_STEER",
    "UP",
    "Airframe",
    "Battery",
    "Flight",
    "Lift",
    "Motor",
    "clip_pwm",
    "lift",
    "locked_motors",
    "mix",
    "mix_rotors",
    "motor_forces",
    "output_to_pwm",
    "push_margin",
    "pwm_to_output",
    "throttle_for",
]
