"""What a vehicle tells: messages from the vehicle to a ground station, as typed values."""

import math
from dataclasses import dataclass
from typing import Any, Self

from hil.mavlink.enums import (
    MODE_FLAG_ARMED,
    MODE_FLAG_CUSTOM,
    MessageId,
)
from hil.mavlink.message import (
    Message,
    Vector,
    clip,
    finite,
    heading_cdeg,
    int16,
    int32,
    milliseconds,
    text_from_wire,
    text_to_wire,
    uint16,
)

UNKNOWN_U16 = 65535


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """HEARTBEAT. `custom_mode` is a `RoverMode` number when the autopilot is ArduPilot."""

    ID = MessageId.HEARTBEAT
    mav_type: int
    autopilot: int
    armed: bool
    custom_mode: int
    system_status: int
    base_mode: int = MODE_FLAG_CUSTOM  # the armed bit is kept in `armed` alone

    @classmethod
    def from_wire(
        cls,
        custom_mode: int,
        mav_type: int,
        autopilot: int,
        base_mode: int,
        status: int,
        _version: int,
    ) -> Self:
        armed = bool(base_mode & MODE_FLAG_ARMED)
        return cls(mav_type, autopilot, armed, custom_mode, status, base_mode & ~MODE_FLAG_ARMED)

    def to_wire(self) -> tuple[Any, ...]:
        base_mode = self.base_mode | (MODE_FLAG_ARMED if self.armed else 0)
        return (self.custom_mode, self.mav_type, self.autopilot, base_mode, self.system_status, 3)


@dataclass(frozen=True, slots=True)
class SysStatus(Message):
    """SYS_STATUS: `Sensor` bits, load 0..1, battery. Remaining is -1 when unknown."""

    ID = MessageId.SYS_STATUS
    present: int
    enabled: int
    health: int
    load: float
    voltage_v: float
    current_a: float
    remaining_percent: int

    @classmethod
    def from_wire(
        cls,
        present: int,
        enabled: int,
        health: int,
        load: int,
        voltage: int,
        current: int,
        *rest: int,
    ) -> Self:
        return cls(present, enabled, health, load / 1e3, voltage / 1e3, current / 1e2, rest[6])

    def to_wire(self) -> tuple[Any, ...]:
        battery = (uint16(self.voltage_v * 1e3), int16(self.current_a * 1e2))
        errors = (0, 0, 0, 0, 0, 0)
        bits = (self.present, self.enabled, self.health)
        return (*bits, uint16(self.load * 1e3), *battery, *errors, self.remaining_percent, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class GpsRaw(Message):
    """GPS_RAW_INT: what the receiver says, before the estimator. Time is since boot."""

    ID = MessageId.GPS_RAW_INT
    time_s: float
    fix_type: int
    lat_deg: float
    lon_deg: float
    alt_m: float
    hdop: float
    speed_mps: float
    course_rad: float
    satellites: int

    @classmethod
    def from_wire(
        cls,
        time_usec: int,
        lat: int,
        lon: int,
        alt: int,
        eph: int,
        _epv: int,
        vel: int,
        cog: int,
        fix_type: int,
        satellites: int,
        *_rest: int,
    ) -> Self:
        where = (lat / 1e7, lon / 1e7, alt / 1e3)
        course_rad = math.radians(cog / 1e2)
        return cls(time_usec / 1e6, fix_type, *where, eph / 1e2, vel / 1e2, course_rad, satellites)

    def to_wire(self) -> tuple[Any, ...]:
        where = (int32(self.lat_deg * 1e7), int32(self.lon_deg * 1e7), int32(self.alt_m * 1e3))
        motion = (uint16(self.speed_mps * 1e2), heading_cdeg(self.course_rad))
        quality = (uint16(self.hdop * 1e2), UNKNOWN_U16)
        fix = (self.fix_type, self.satellites)
        return (
            clip(self.time_s * 1e6, 0, 2**64 - 1),
            *where,
            *quality,
            *motion,
            *fix,
            0,
            0,
            0,
            0,
            0,
            0,
        )


@dataclass(frozen=True, slots=True)
class GlobalPosition(Message):
    """GLOBAL_POSITION_INT: the estimate in WGS84; velocity is NED."""

    ID = MessageId.GLOBAL_POSITION_INT
    time_s: float
    lat_deg: float
    lon_deg: float
    alt_m: float
    relative_alt_m: float
    velocity_mps: Vector
    yaw_rad: float

    @classmethod
    def from_wire(
        cls, ms: int, lat: int, lon: int, alt: int, rel: int, vx: int, vy: int, vz: int, hdg: int
    ) -> Self:
        velocity = (vx / 1e2, vy / 1e2, vz / 1e2)
        yaw_rad = math.radians(hdg / 1e2)
        return cls(ms / 1e3, lat / 1e7, lon / 1e7, alt / 1e3, rel / 1e3, velocity, yaw_rad)

    def to_wire(self) -> tuple[Any, ...]:
        where = (int32(self.lat_deg * 1e7), int32(self.lon_deg * 1e7))
        heights = (int32(self.alt_m * 1e3), int32(self.relative_alt_m * 1e3))
        vx, vy, vz = self.velocity_mps
        velocity = (int16(vx * 1e2), int16(vy * 1e2), int16(vz * 1e2))
        return (milliseconds(self.time_s), *where, *heights, *velocity, heading_cdeg(self.yaw_rad))


@dataclass(frozen=True, slots=True)
class LocalPosition(Message):
    """LOCAL_POSITION_NED: the estimate in metres from the origin."""

    ID = MessageId.LOCAL_POSITION_NED
    time_s: float
    position_m: Vector
    velocity_mps: Vector

    @classmethod
    def from_wire(
        cls, ms: int, x: float, y: float, z: float, vx: float, vy: float, vz: float
    ) -> Self | None:
        if not finite(x, y, z, vx, vy, vz):
            return None
        return cls(ms / 1e3, (x, y, z), (vx, vy, vz))

    def to_wire(self) -> tuple[Any, ...]:
        return (milliseconds(self.time_s), *self.position_m, *self.velocity_mps)


@dataclass(frozen=True, slots=True)
class Attitude(Message):
    """ATTITUDE: Euler angles and body rates."""

    ID = MessageId.ATTITUDE
    time_s: float
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    roll_rate_radps: float
    pitch_rate_radps: float
    yaw_rate_radps: float

    @classmethod
    def from_wire(cls, ms: int, *angles: float) -> Self | None:
        return cls(ms / 1e3, *angles) if finite(*angles) else None

    def to_wire(self) -> tuple[Any, ...]:
        angles = (self.roll_rad, self.pitch_rad, self.yaw_rad)
        rates = (self.roll_rate_radps, self.pitch_rate_radps, self.yaw_rate_radps)
        return (milliseconds(self.time_s), *angles, *rates)


@dataclass(frozen=True, slots=True)
class ServoOutputs(Message):
    """SERVO_OUTPUT_RAW: 16 outputs as the autopilot commands them, in us; 0 is no pulse.

    The time field has 32 bits of microseconds: it wraps after 71 minutes.
    """

    ID = MessageId.SERVO_OUTPUT_RAW
    time_s: float
    pwm_us: tuple[int, ...]

    @classmethod
    def from_wire(cls, time_usec: int, *rest: int) -> Self:
        return cls(time_usec / 1e6, rest[:8] + rest[9:])

    def to_wire(self) -> tuple[Any, ...]:
        return (round(self.time_s * 1e6) % 2**32, *self.pwm_us[:8], 0, *self.pwm_us[8:])


@dataclass(frozen=True, slots=True)
class Battery(Message):
    """BATTERY_STATUS of one battery."""

    ID = MessageId.BATTERY_STATUS
    voltage_v: float
    current_a: float
    consumed_mah: float
    remaining_percent: int

    @classmethod
    def from_wire(cls, consumed: int, _energy: int, _temperature: int, *rest: int) -> Self:
        millivolts = sum(v for v in rest[:10] if v != UNKNOWN_U16)
        return cls(millivolts / 1e3, rest[10] / 1e2, float(consumed), rest[14])

    def to_wire(self) -> tuple[Any, ...]:
        voltages = (uint16(self.voltage_v * 1e3), *(UNKNOWN_U16,) * 9)
        kind = (0, 1, 1)  # id, MAV_BATTERY_FUNCTION_ALL, MAV_BATTERY_TYPE_LIPO
        head = (int32(self.consumed_mah), -1, 32767, *voltages, int16(self.current_a * 1e2))
        return (*head, *kind, self.remaining_percent, 0, 1, 0, 0, 0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class ExtendedSysState(Message):
    """EXTENDED_SYS_STATE. landed_state: 1 on ground, 2 in air."""

    ID = MessageId.EXTENDED_SYS_STATE
    landed_state: int

    @classmethod
    def from_wire(cls, _vtol_state: int, landed_state: int) -> Self:
        return cls(landed_state)

    def to_wire(self) -> tuple[Any, ...]:
        return (0, self.landed_state)


@dataclass(frozen=True, slots=True)
class HomePosition(Message):
    """HOME_POSITION: where RTL goes, in WGS84 and in metres from the origin."""

    ID = MessageId.HOME_POSITION
    lat_deg: float
    lon_deg: float
    alt_m: float
    position_m: Vector

    @classmethod
    def from_wire(
        cls, lat: int, lon: int, alt: int, x: float, y: float, z: float, *_rest: float
    ) -> Self | None:
        return cls(lat / 1e7, lon / 1e7, alt / 1e3, (x, y, z)) if finite(x, y, z) else None

    def to_wire(self) -> tuple[Any, ...]:
        where = (int32(self.lat_deg * 1e7), int32(self.lon_deg * 1e7), int32(self.alt_m * 1e3))
        return (*where, *self.position_m, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0)


@dataclass(frozen=True, slots=True)
class GpsOrigin(Message):
    """GPS_GLOBAL_ORIGIN: where local NED has its zero."""

    ID = MessageId.GPS_GLOBAL_ORIGIN
    lat_deg: float
    lon_deg: float
    alt_m: float

    @classmethod
    def from_wire(cls, lat: int, lon: int, alt: int, _time_usec: int) -> Self:
        return cls(lat / 1e7, lon / 1e7, alt / 1e3)

    def to_wire(self) -> tuple[Any, ...]:
        return (int32(self.lat_deg * 1e7), int32(self.lon_deg * 1e7), int32(self.alt_m * 1e3), 0)


@dataclass(frozen=True, slots=True)
class StatusText(Message):
    """STATUSTEXT: a line for people (50 characters)."""

    ID = MessageId.STATUSTEXT
    severity: int
    text: str

    @classmethod
    def from_wire(cls, severity: int, text: bytes, _id: int, _chunk_seq: int) -> Self:
        return cls(severity, text_from_wire(text))

    def to_wire(self) -> tuple[Any, ...]:
        return (self.severity, text_to_wire(self.text)[:50], 0, 0)


@dataclass(frozen=True, slots=True)
class AutopilotVersion(Message):
    """AUTOPILOT_VERSION: `Capability` bits, (major, minor, patch, type) and a unique id."""

    ID = MessageId.AUTOPILOT_VERSION
    capabilities: int
    version: tuple[int, int, int, int]
    uid: int

    @classmethod
    def from_wire(cls, capabilities: int, uid: int, flight: int, *_rest: int) -> Self:
        major, minor, patch, kind = flight.to_bytes(4, "big")
        return cls(capabilities, (major, minor, patch, kind), uid)

    def to_wire(self) -> tuple[Any, ...]:
        flight = int.from_bytes(bytes(self.version), "big")
        return (self.capabilities, self.uid, flight, *(0,) * 5, *(0,) * 42)
