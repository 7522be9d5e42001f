"""Driving by hand and by points on the globe: messages from a ground station to a vehicle."""

import math
from dataclasses import dataclass
from typing import Any, Self

from hil.mavlink.enums import MessageId, TypeMask
from hil.mavlink.message import Message, Vector, clip, finite, int32, milliseconds

NO_AXIS = 32767  # INT16_MAX: the joystick has no such axis
RELEASED_US = 0
IGNORED_US = 65535
CHANNELS = 18


@dataclass(frozen=True, slots=True)
class GlobalSetpoint(Message):
    """SET_POSITION_TARGET_GLOBAL_INT. A field that the type mask ignores is None.

    `position` is latitude and longitude (deg) and altitude (m, as `frame` counts it); it counts as
    ignored when its latitude or longitude is, and an ignored altitude reads 0. Velocity is NED.
    """

    ID = MessageId.SET_POSITION_TARGET_GLOBAL_INT
    target_sysid: int
    target_compid: int
    time_s: float
    frame: int
    type_mask: int
    position: Vector | None
    velocity_mps: Vector | None
    yaw_rad: float | None
    yaw_rate_radps: float | None

    @classmethod
    def from_wire(cls, ms: int, lat: int, lon: int, alt: float, *f: Any) -> Self | None:
        mask = f[8]
        place = None
        if not mask & (TypeMask.X | TypeMask.Y):
            place = (lat / 1e7, lon / 1e7, 0.0 if mask & TypeMask.Z else alt)
        velocity = None
        if not mask & (TypeMask.VX | TypeMask.VY):
            velocity = (f[0], f[1], 0.0 if mask & TypeMask.VZ else f[2])
        yaw = None if mask & TypeMask.YAW else f[6]
        yaw_rate = None if mask & TypeMask.YAW_RATE else f[7]
        if not finite(*(place or ()), *(velocity or ()), yaw or 0.0, yaw_rate or 0.0):
            return None
        return cls(f[9], f[10], ms / 1e3, f[11], mask, place, velocity, yaw, yaw_rate)

    def to_wire(self) -> tuple[Any, ...]:
        lat, lon, alt = self.position or (0.0, 0.0, 0.0)
        head = (milliseconds(self.time_s), int32(lat * 1e7), int32(lon * 1e7), alt)
        motion = (*(self.velocity_mps or (0.0,) * 3), 0.0, 0.0, 0.0)
        turn = (self.yaw_rad or 0.0, self.yaw_rate_radps or 0.0)
        target = (self.target_sysid, self.target_compid, self.frame)
        return (*head, *motion, *turn, self.type_mask, *target)


@dataclass(frozen=True, slots=True)
class ManualControl(Message):
    """MANUAL_CONTROL: joystick axes in -1..1, None for an axis that is not there.

    It has no target component.
    """

    ID = MessageId.MANUAL_CONTROL
    target_sysid: int
    x: float | None
    y: float | None
    z: float | None
    r: float | None
    buttons: int = 0

    @classmethod
    def from_wire(cls, x: int, y: int, z: int, r: int, buttons: int, sysid: int, *_: int) -> Self:
        return cls(sysid, _axis(x), _axis(y), _axis(z), _axis(r), buttons)

    def to_wire(self) -> tuple[Any, ...]:
        axes = tuple(
            NO_AXIS if a is None else clip(a * 1e3, -1000, 1000)
            for a in (self.x, self.y, self.z, self.r)
        )
        return (*axes, self.buttons, self.target_sysid, *(0,) * 10)


def _axis(raw: int) -> float | None:
    return None if raw == NO_AXIS else max(-1.0, min(1.0, raw / 1e3))


@dataclass(frozen=True, slots=True)
class RcOverride(Message):
    """RC_CHANNELS_OVERRIDE: 18 channels in us; of 1 to 8, 0 hands one back and 65535 leaves it."""

    ID = MessageId.RC_CHANNELS_OVERRIDE
    target_sysid: int
    target_compid: int
    channels_us: tuple[int, ...]

    @classmethod
    def from_wire(cls, *f: int) -> Self:
        return cls(f[8], f[9], f[:8] + f[10:])

    def to_wire(self) -> tuple[Any, ...]:
        filled = (*self.channels_us, *(IGNORED_US,) * 8)[:8]
        rest = (*self.channels_us[8:], *(0,) * 10)[:10]
        return (*filled, self.target_sysid, self.target_compid, *rest)


@dataclass(frozen=True, slots=True)
class RcChannels(Message):
    """RC_CHANNELS: what the vehicle takes its sticks to be (us); 65535 is not there."""

    ID = MessageId.RC_CHANNELS
    time_s: float
    channels_us: tuple[int, ...]

    @classmethod
    def from_wire(cls, ms: int, *f: int) -> Self:
        return cls(ms / 1e3, f[: min(f[18], CHANNELS)])

    def to_wire(self) -> tuple[Any, ...]:
        filled = (*self.channels_us, *(IGNORED_US,) * CHANNELS)[:CHANNELS]
        no_rssi = 255
        return (milliseconds(self.time_s), *filled, len(self.channels_us), no_rssi)


def stick(pwm_us: int) -> float | None:
    """A channel as a stick, -1..1; None when it is not overridden (0, 65535, or no pulse)."""
    if not 800 <= pwm_us <= 2200:
        return None
    value = (pwm_us - 1500) / 500
    return math.copysign(min(1.0, abs(value)), value)
