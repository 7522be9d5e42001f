"""What a sender says, by the names of what it wants; units as in the messages."""

import math

from hil.mavlink.enums import (
    AUTOPILOT_INVALID,
    COMPONENT_AUTOPILOT,
    FORCE_DISARM_MAGIC,
    MODE_FLAG_CUSTOM,
    TYPE_GCS,
    Command,
    Frame,
    ParamType,
    SystemStatus,
    TypeMask,
)
from hil.mavlink.frame import Framer
from hil.mavlink.requests import (
    CommandLong,
    LocalSetpoint,
    ParamRequestList,
    ParamRequestRead,
    ParamSet,
    SetMode,
)
from hil.mavlink.services import Timesync
from hil.mavlink.telemetry import Heartbeat

_VELOCITY_MASK = int(TypeMask.POSITION | TypeMask.ACCELERATION | TypeMask.YAW_RATE)
_POSITION_MASK = int(TypeMask.VELOCITY | TypeMask.ACCELERATION | TypeMask.YAW_RATE)


class Encoder(Framer):
    """A sender of MAVLink. `encode(value)` sends any message; the rest is what a station needs.

    `target` is the system id of a vehicle; its autopilot is component 1.
    """

    def gcs_heartbeat(self) -> bytes:
        """HEARTBEAT of a ground station, due each second."""
        return self.encode(
            Heartbeat(TYPE_GCS, AUTOPILOT_INVALID, False, 0, SystemStatus.ACTIVE, base_mode=0)
        )

    def command_long(self, target: int, command: int, *params: float) -> bytes:
        """COMMAND_LONG; params that are not given are 0."""
        p1, p2, p3, p4, p5, p6, p7 = (*params, *(0.0,) * (7 - len(params)))
        filled = (p1, p2, p3, p4, p5, p6, p7)
        return self.encode(CommandLong(target, COMPONENT_AUTOPILOT, command, filled))

    def arm(self, target: int, armed: bool = True) -> bytes:
        """MAV_CMD_COMPONENT_ARM_DISARM."""
        return self.command_long(target, Command.COMPONENT_ARM_DISARM, float(armed))

    def emergency_stop(self, target: int) -> bytes:
        """MAV_CMD_COMPONENT_ARM_DISARM: disarm whatever the state is."""
        return self.command_long(
            target, Command.COMPONENT_ARM_DISARM, 0.0, float(FORCE_DISARM_MAGIC)
        )

    def set_mode(self, target: int, custom_mode: int) -> bytes:
        """MAV_CMD_DO_SET_MODE (176), which is acknowledged, unlike SET_MODE."""
        return self.command_long(
            target, Command.DO_SET_MODE, float(MODE_FLAG_CUSTOM), float(custom_mode)
        )

    def set_mode_message(self, target: int, custom_mode: int) -> bytes:
        """SET_MODE (11), for autopilots that know nothing newer."""
        return self.encode(SetMode(target, custom_mode))

    def velocity_setpoint(
        self, target: int, time_ms: int, north_mps: float, east_mps: float, yaw_rad: float | None
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED, masks 3527 (velocity) or 2503 (velocity and yaw)."""
        mask = _VELOCITY_MASK | (TypeMask.YAW if yaw_rad is None else 0)
        velocity = (north_mps, east_mps, 0.0)
        return self._setpoint(target, time_ms, mask, None, velocity, yaw_rad)

    def turning_setpoint(
        self, target: int, time_ms: int, speed_mps: float, yaw_rate_radps: float
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED, mask 1479 (velocity and yaw rate): speed along the nose,
        signed as the first component is."""
        mask = int(TypeMask.POSITION | TypeMask.ACCELERATION | TypeMask.YAW)
        velocity = (speed_mps, 0.0, 0.0)
        return self._setpoint(target, time_ms, mask, None, velocity, None, yaw_rate_radps)

    def position_setpoint(
        self, target: int, time_ms: int, north_m: float, east_m: float, yaw_rad: float | None = None
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED, masks 3576 (position) or 2552 (position and yaw)."""
        mask = _POSITION_MASK | (TypeMask.YAW if yaw_rad is None else 0)
        position = (north_m, east_m, 0.0)
        return self._setpoint(target, time_ms, mask, position, None, yaw_rad)

    def _setpoint(
        self,
        target: int,
        time_ms: int,
        mask: int,
        position_m: tuple[float, float, float] | None,
        velocity_mps: tuple[float, float, float] | None,
        yaw_rad: float | None,
        yaw_rate_radps: float | None = None,
    ) -> bytes:
        return self.encode(
            LocalSetpoint(
                target_sysid=target,
                target_compid=COMPONENT_AUTOPILOT,
                time_s=time_ms / 1e3,
                frame=Frame.LOCAL_NED,
                type_mask=int(mask),
                position_m=position_m,
                velocity_mps=velocity_mps,
                yaw_rad=yaw_rad,
                yaw_rate_radps=yaw_rate_radps,
            )
        )

    def timesync(self, tc1_ns: int, ts1_ns: int) -> bytes:
        """TIMESYNC: tc1 = 0 asks; the answer mirrors ts1."""
        return self.encode(Timesync(tc1_ns, ts1_ns))

    def param_set(
        self, target: int, name: str, value: float, param_type: int = ParamType.REAL32
    ) -> bytes:
        """PARAM_SET; integers travel as floats."""
        return self.encode(ParamSet(target, COMPONENT_AUTOPILOT, name, value, param_type))

    def param_request_list(self, target: int) -> bytes:
        """PARAM_REQUEST_LIST."""
        return self.encode(ParamRequestList(target, COMPONENT_AUTOPILOT))

    def param_request_read(self, target: int, name: str, index: int = -1) -> bytes:
        """PARAM_REQUEST_READ, by name unless an index is given."""
        return self.encode(ParamRequestRead(target, COMPONENT_AUTOPILOT, name, index))

    def set_message_interval(self, target: int, message_id: int, hz: float) -> bytes:
        """MAV_CMD_SET_MESSAGE_INTERVAL; 0 Hz switches the message off."""
        interval_us = -1.0 if hz <= 0 or not math.isfinite(hz) else round(1e6 / hz)
        return self.command_long(
            target, Command.SET_MESSAGE_INTERVAL, float(message_id), interval_us
        )

    def request_message(self, target: int, message_id: int) -> bytes:
        """MAV_CMD_REQUEST_MESSAGE: send it once, now."""
        return self.command_long(target, Command.REQUEST_MESSAGE, float(message_id))

    def inject_failure(self, target: int, unit: int, failure_type: int, instance: int) -> bytes:
        """MAV_CMD_INJECT_FAILURE (420); numbers as in `hil.faults`."""
        numbers = (float(unit), float(failure_type), float(instance))
        return self.command_long(target, Command.INJECT_FAILURE, *numbers)
