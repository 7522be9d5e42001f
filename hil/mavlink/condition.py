"""How the parts of a vehicle are: inertial sensors, filter, ESCs, head-up figures, fence."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from hil.mavlink.enums import MessageId
from hil.mavlink.message import (
    Message,
    Vector,
    clip,
    finite,
    heading_cdeg,
    int16,
    milliseconds,
    uint16,
)

MILLI_G_MPS2 = 9.80665e-3
ESCS = 4  # in one ESC_TELEMETRY message


def _inertial_to_wire(accel_mps2: Vector, gyro_radps: Vector, mag_gauss: Vector) -> list[int]:
    accel = [int16(a / MILLI_G_MPS2) for a in accel_mps2]
    return [*accel, *(int16(g * 1e3) for g in gyro_radps), *(int16(m * 1e3) for m in mag_gauss)]


def _inertial_from_wire(f: tuple[int, ...]) -> tuple[Vector, Vector, Vector]:
    accel = (f[0] * MILLI_G_MPS2, f[1] * MILLI_G_MPS2, f[2] * MILLI_G_MPS2)
    return accel, (f[3] / 1e3, f[4] / 1e3, f[5] / 1e3), (f[6] / 1e3, f[7] / 1e3, f[8] / 1e3)


@dataclass(frozen=True, slots=True)
class RawImu(Message):
    """RAW_IMU in SCALED_IMU's units, as ArduPilot sends it: specific force, rates, field; body."""

    ID = MessageId.RAW_IMU
    time_s: float
    accel_mps2: Vector
    gyro_radps: Vector
    mag_gauss: Vector

    @classmethod
    def from_wire(cls, time_usec: int, *f: int) -> Self:
        return cls(time_usec / 1e6, *_inertial_from_wire(f))

    def to_wire(self) -> tuple[Any, ...]:
        fields = _inertial_to_wire(self.accel_mps2, self.gyro_radps, self.mag_gauss)
        return (clip(self.time_s * 1e6, 0, 2**64 - 1), *fields, 0, 0)


@dataclass(frozen=True, slots=True)
class ScaledImu(RawImu):
    """SCALED_IMU."""

    ID: ClassVar[MessageId] = MessageId.SCALED_IMU

    @classmethod
    def from_wire(cls, ms: int, *f: int) -> Self:
        return cls(ms / 1e3, *_inertial_from_wire(f))

    def to_wire(self) -> tuple[Any, ...]:
        fields = _inertial_to_wire(self.accel_mps2, self.gyro_radps, self.mag_gauss)
        return (milliseconds(self.time_s), *fields, 0)


@dataclass(frozen=True, slots=True)
class EkfStatus(Message):
    """EKF_STATUS_REPORT: innovation test ratios (1 is the limit) and EKF_STATUS_FLAGS."""

    ID = MessageId.EKF_STATUS_REPORT
    velocity_ratio: float
    position_ratio: float
    height_ratio: float
    compass_ratio: float
    flags: int

    @classmethod
    def from_wire(
        cls, vel: float, hor: float, ver: float, mag: float, _ter: float, flags: int, _air: float
    ) -> Self | None:
        return cls(vel, hor, ver, mag, flags) if finite(vel, hor, ver, mag) else None

    def to_wire(self) -> tuple[Any, ...]:
        ratios = (self.velocity_ratio, self.position_ratio, self.height_ratio, self.compass_ratio)
        return (*ratios, 0.0, self.flags, 0.0)


@dataclass(frozen=True, slots=True)
class Esc:
    """One speed controller: revolutions a minute, volt, ampere, charge since boot."""

    rpm: int
    voltage_v: float
    current_a: float
    consumed_mah: int
    temperature_degc: int
    count: int  # telemetry packets received from it


@dataclass(frozen=True, slots=True)
class EscTelemetry(Message):
    """ESC_TELEMETRY_1_TO_4; an ESC that is not there reads zero throughout."""

    ID = MessageId.ESC_TELEMETRY_1_TO_4
    escs: tuple[Esc, Esc, Esc, Esc]

    @classmethod
    def from_wire(cls, *f: int) -> Self:
        volts, amps, mah, rpm, count, degc = (f[i : i + ESCS] for i in range(0, 6 * ESCS, ESCS))
        escs = [
            Esc(rpm[i], volts[i] / 1e2, amps[i] / 1e2, mah[i], degc[i], count[i])
            for i in range(ESCS)
        ]
        return cls((escs[0], escs[1], escs[2], escs[3]))

    def to_wire(self) -> tuple[Any, ...]:
        return (
            *(uint16(e.voltage_v * 1e2) for e in self.escs),
            *(uint16(e.current_a * 1e2) for e in self.escs),
            *(uint16(e.consumed_mah) for e in self.escs),
            *(uint16(abs(e.rpm)) for e in self.escs),
            *(e.count % 65536 for e in self.escs),
            *(clip(e.temperature_degc, 0, 255) for e in self.escs),
        )


@dataclass(frozen=True, slots=True)
class VfrHud(Message):
    """VFR_HUD: speed over ground, height, climb, heading, throttle (0..1)."""

    ID = MessageId.VFR_HUD
    groundspeed_mps: float
    alt_m: float
    climb_mps: float
    heading_rad: float
    throttle: float

    @classmethod
    def from_wire(
        cls, _air: float, ground: float, alt: float, climb: float, heading: int, throttle: int
    ) -> Self | None:
        if not finite(ground, alt, climb):
            return None
        return cls(ground, alt, climb, math.radians(heading), throttle / 100)

    def to_wire(self) -> tuple[Any, ...]:
        heading = heading_cdeg(self.heading_rad) // 100
        speeds = (self.groundspeed_mps, self.groundspeed_mps)
        throttle = clip(abs(self.throttle) * 100, 0, 65535)
        return (*speeds, self.alt_m, self.climb_mps, heading, throttle)


@dataclass(frozen=True, slots=True)
class FenceStatus(Message):
    """FENCE_STATUS: whether the vehicle is outside, how often it has been, and since when."""

    ID = MessageId.FENCE_STATUS
    breached: bool
    breach_count: int
    breach_time_s: float

    @classmethod
    def from_wire(
        cls, ms: int, count: int, status: int, _breach_type: int, _mitigation: int
    ) -> Self:
        return cls(bool(status), count, ms / 1e3)

    def to_wire(self) -> tuple[Any, ...]:
        boundary = 3 if self.breached else 0  # FENCE_BREACH_BOUNDARY, _NONE
        head = (milliseconds(self.breach_time_s), self.breach_count % 65536)
        return (*head, int(self.breached), boundary, 0)
