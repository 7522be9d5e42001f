"""A second physics link: MAVLink's HIL messages, for a board in HIL mode (pure).

World to board: HIL_SENSOR and HIL_GPS. Board to world: HIL_ACTUATOR_CONTROLS, whose controls are
-1..1 (0..1 for a rotor) and become pulses as on the other link. Tried with a loopback peer alone.
"""

import math
from dataclasses import dataclass

from pymavlink.dialects.v20 import common

from hil.airframe import PWM_OFF_US, output_to_pwm
from hil.frames import Origin, ned_to_wgs84
from hil.mavlink.stream import frames_of, message_id
from hil.physics_link import PhysicsState

MODE_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
SEA_LEVEL_HPA, SCALE_HEIGHT_M = 1013.25, 8434.5
FIELD_GAUSS = (0.21, 0.0, 0.43)  # middle Europe, without declination
ALL_FIELDS = 0x1FFF  # accel, gyro, mag, pressures, altitude, temperature
FIX_3D, SATELLITES, EPH_CM = 3, 12, 50
CHANNELS = 16


@dataclass(frozen=True)
class Controls:
    """HIL_ACTUATOR_CONTROLS: pulses in us, 0 while the board is disarmed."""

    time_s: float
    pwm_us: tuple[int, ...]


class HilLink:
    """Packs and unpacks; one for each board. `sysid` is the simulator's."""

    def __init__(self, origin: Origin, sysid: int = 1, compid: int = 200) -> None:
        self._origin = origin
        self._mav = common.MAVLink(None, srcSystem=sysid, srcComponent=compid)
        self._reader = common.MAVLink(None)

    def sensor(self, state: PhysicsState) -> bytes:
        """HIL_SENSOR of one step; send it at the rate of the physics."""
        height_m = self._origin.alt_m - state.position_m[2]
        pressure = SEA_LEVEL_HPA * math.exp(-height_m / SCALE_HEIGHT_M)
        message = common.MAVLink_hil_sensor_message(
            round(state.time_s * 1e6),
            *state.accel_body_mps2,
            *state.gyro_radps,
            *_in_body(FIELD_GAUSS, state.attitude_rad),
            pressure,
            0.0,
            height_m,
            20.0,
            ALL_FIELDS,
        )
        return bytes(message.pack(self._mav))

    def gps(self, state: PhysicsState) -> bytes:
        """HIL_GPS; send it at the rate of a receiver."""
        lat, lon = ned_to_wgs84(state.position_m[0], state.position_m[1], self._origin)
        vn, ve, vd = state.velocity_mps
        course = math.degrees(math.atan2(ve, vn)) % 360.0
        message = common.MAVLink_hil_gps_message(
            round(state.time_s * 1e6),
            FIX_3D,
            round(lat * 1e7),
            round(lon * 1e7),
            round((self._origin.alt_m - state.position_m[2]) * 1e3),
            EPH_CM,
            EPH_CM,
            round(math.hypot(vn, ve) * 100),
            round(vn * 100),
            round(ve * 100),
            round(vd * 100),
            round(course * 100) % 36000,
            SATELLITES,
        )
        return bytes(message.pack(self._mav))

    def controls(self, datagram: bytes) -> list[Controls]:
        """What a board wants of its motors. Never raises."""
        found = []
        for _, frame in frames_of(datagram):
            if message_id(frame) != common.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS:
                continue
            message = self._reader.decode(bytearray(frame))
            armed = bool(message.mode & MODE_ARMED)
            pulses = tuple(_pulse(c) if armed else PWM_OFF_US for c in message.controls[:CHANNELS])
            found.append(Controls(message.time_usec / 1e6, pulses))
        return found


def _pulse(control: float) -> int:
    return output_to_pwm(control if math.isfinite(control) else None)


def _in_body(
    ned: tuple[float, float, float], attitude_rad: tuple[float, float, float]
) -> tuple[float, float, float]:
    """A vector from NED to body axes (Euler angles roll, pitch, yaw, turned in z, y, x)."""
    roll, pitch, yaw = attitude_rad
    n, e, d = ned
    x, y = math.cos(yaw) * n + math.sin(yaw) * e, -math.sin(yaw) * n + math.cos(yaw) * e
    x, z = math.cos(pitch) * x - math.sin(pitch) * d, math.sin(pitch) * x + math.cos(pitch) * d
    return x, math.cos(roll) * y + math.sin(roll) * z, -math.sin(roll) * y + math.cos(roll) * z
