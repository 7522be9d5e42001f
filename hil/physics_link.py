"""The physics link: ArduPilot's JSON simulator interface, both directions (pure).

Autopilot to world: a little-endian packet of motor outputs, 16 or 32 channels. World to autopilot:
one line of JSON with the state. What is malformed decodes to None; nothing here raises on input.
Source: ArduPilot, libraries/SITL/SIM_JSON.h and its examples (V4.6).
"""

import json
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hil.airframe import GRAVITY_MPS2

Vector3 = tuple[float, float, float]

_LAYOUTS = {16: (18458, struct.Struct("<HHI16H")), 32: (29569, struct.Struct("<HHI32H"))}
_CHANNELS_BY_SIZE = {layout.size: channels for channels, (_, layout) in _LAYOUTS.items()}
_COMPACT = json.JSONEncoder(separators=(",", ":"))
AT_REST_MPS2: Vector3 = (0.0, 0.0, -GRAVITY_MPS2)


@dataclass(frozen=True)
class ServoFrame:
    """Motor outputs for one frame: `pwm_us` has 16 or 32 channels, 0 where none is assigned."""

    frame_rate_hz: int
    frame_count: int
    pwm_us: tuple[int, ...]


@dataclass(frozen=True)
class PhysicsState:
    """State of one vehicle. Position and velocity are NED from home, the rest is body axes.

    `accel_body_mps2` is specific force, the mean over the frame: at rest (0, 0, -9.80665).
    """

    time_s: float
    gyro_radps: Vector3
    accel_body_mps2: Vector3
    position_m: Vector3
    velocity_mps: Vector3
    attitude_rad: Vector3  # roll, pitch, yaw


def pad_channels(pwm_us: Sequence[int]) -> tuple[int, ...]:
    """Fill up to 16 channels with 0 (not assigned)."""
    return (*pwm_us, *[0] * (16 - len(pwm_us)))


def encode_frame(frame: ServoFrame) -> bytes:
    """Raises ValueError when `pwm_us` has neither 16 nor 32 channels, struct.error off range."""
    if len(frame.pwm_us) not in _LAYOUTS:
        raise ValueError(f"pwm_us has {len(frame.pwm_us)} channels; 16 or 32 are needed")
    magic, layout = _LAYOUTS[len(frame.pwm_us)]
    return layout.pack(magic, frame.frame_rate_hz, frame.frame_count, *frame.pwm_us)


def decode_frame(datagram: bytes) -> ServoFrame | None:
    """The frame in a datagram, or None when it is not one."""
    channels = _CHANNELS_BY_SIZE.get(len(datagram))
    if channels is None:
        return None
    expected_magic, layout = _LAYOUTS[channels]
    magic, rate_hz, count, *pwm_us = layout.unpack(datagram)
    if magic != expected_magic or rate_hz == 0:
        return None
    return ServoFrame(rate_hz, count, tuple(pwm_us))


def encode_state(state: PhysicsState) -> bytes:
    """One line of JSON without spaces: the firmware's parser is strstr and sscanf."""
    tree = {
        "timestamp": state.time_s,
        "imu": {"gyro": state.gyro_radps, "accel_body": state.accel_body_mps2},
        "position": state.position_m,
        "velocity": state.velocity_mps,
        "attitude": state.attitude_rad,
        "no_time_sync": 1,  # the world sets the pace
    }
    return b"\n" + _COMPACT.encode(tree).encode() + b"\n"


def decode_state(datagram: bytes) -> PhysicsState | None:
    """The state in a datagram, or None when a required field is missing or not finite."""
    try:
        tree = json.loads(datagram)
        imu = tree["imu"]
        return PhysicsState(
            time_s=_number(tree["timestamp"]),
            gyro_radps=_vector(imu["gyro"]),
            accel_body_mps2=_vector(imu["accel_body"]),
            position_m=_vector(tree["position"]),
            velocity_mps=_vector(tree["velocity"]),
            attitude_rad=_vector(tree["attitude"]),
        )
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None


def _number(value: Any) -> float:
    if type(value) is float:
        number = value
    elif type(value) is int:  # not a bool, and JSON has no others
        number = float(value)
    else:
        raise TypeError("not a number")
    if not math.isfinite(number):
        raise ValueError("not finite")
    return number


def _vector(value: Any) -> Vector3:
    if not isinstance(value, list):
        raise TypeError("not a list")
    x, y, z = map(_number, value)
    return x, y, z
