"""Rotors: outputs to thrust and torques, and back (pure).

Body axes are x forward, y right, z down; torques are about them. An output of -1 is throttle 0.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hil.airframe.model import Airframe

MOST_TILT = 0.25  # share of the throttle range that attitude may take, so that some is left to lift


@dataclass(frozen=True)
class Lift:
    """What all rotors give: thrust (N, upwards in the body) and torques (N m, body axes)."""

    thrust_n: float
    roll_nm: float
    pitch_nm: float
    yaw_nm: float


def lift(airframe: Airframe, outputs: Sequence[float | None]) -> Lift:
    """Thrust and torques for outputs in [-1, 1]; a rotor without power gives none."""
    thrust = roll = pitch = yaw = 0.0
    flight = airframe.flight
    if flight is None:
        return Lift(0.0, 0.0, 0.0, 0.0)
    for motor, output in zip(airframe.motors, outputs, strict=True):
        if output is None:
            continue
        u = (output + 1.0) / 2.0
        t = motor.stall_force_n * ((1.0 - flight.thrust_expo) * u + flight.thrust_expo * u * u)
        thrust += t
        roll -= motor.position_m[1] * t
        pitch += motor.position_m[0] * t
        yaw += motor.spin * flight.drag_torque_m * t
    return Lift(thrust, roll, pitch, yaw)


def throttle_for(airframe: Airframe, thrust_share: float) -> float:
    """The throttle (0..1) at which a rotor gives that share of its maximum thrust."""
    if airframe.flight is None or airframe.flight.thrust_expo == 0.0:
        return thrust_share
    e = airframe.flight.thrust_expo
    share = max(0.0, min(1.0, thrust_share))
    return (math.sqrt((1.0 - e) ** 2 + 4.0 * e * share) - (1.0 - e)) / (2.0 * e)


def mix_rotors(
    airframe: Airframe, thrust: float, roll: float, pitch: float, yaw: float
) -> tuple[float, ...]:
    """Outputs for a share of the maximum thrust and for turning moments, in the same unit.

    Attitude goes before lift: the mean thrust gives way until every rotor is within its range.
    """
    turns = [
        math.copysign(1.0, m.position_m[0]) * pitch
        - math.copysign(1.0, m.position_m[1]) * roll
        + m.spin * yaw
        for m in airframe.motors
    ]
    largest = max(map(abs, turns))
    scale = min(1.0, MOST_TILT / largest) if largest > 0.0 else 1.0
    turns = [turn * scale for turn in turns]
    lifted = max(-min(turns), min(1.0 - max(turns), thrust))
    return tuple(2.0 * throttle_for(airframe, lifted + turn) - 1.0 for turn in turns)
