"""PX4, in OFFBOARD. Tested against a stand-in that behaves like it; not yet run on the firmware."""

import struct
from typing import ClassVar

from base_station.autopilots.adapter import Autopilot, Setting
from base_station.receiving.telemetry import Status
from hil.mavlink import (
    MODE_FLAG_CUSTOM,
    Command,
    CommandLong,
    Encoder,
    FixType,
    ParamType,
    ParamValue,
)

# px4_custom_mode: main mode in bits 16-23, sub mode in bits 24-31
_OFFBOARD = 6 << 16
_AUTO_LOITER = 4 << 16 | 3 << 24


class Px4(Autopilot):
    """OFFBOARD is refused unless set-points already flow (more than 2 Hz), and left 0.5 s later.

    COM_OBL_RC_ACT and NAV_DLL_ACT say what it does then; NAV_DLL_ACT = 1 is hold.
    """

    NAME: ClassVar[str] = "px4"
    needs_setpoints_first: ClassVar[bool] = True
    setpoint_timeout_s: ClassVar[float] = 0.5  # COM_OF_LOSS_T

    @property
    def driven_mode(self) -> int:
        return _OFFBOARD

    @property
    def hold_mode(self) -> int:
        return _AUTO_LOITER

    def ready(self, status: Status) -> bool:
        return status.prearm_ok and status.gps_fix >= FixType.FIX_3D

    def set_mode(self, encoder: Encoder, sysid: int, mode: int) -> bytes:
        """MAV_CMD_DO_SET_MODE: main and sub mode travel in fields of their own."""
        return encoder.command_long(
            sysid,
            Command.DO_SET_MODE,
            float(MODE_FLAG_CUSTOM),
            float(mode >> 16 & 0xFF),
            float(mode >> 24 & 0xFF),
        )

    def drives(self, command: CommandLong) -> bool:
        return int(command.params[1]) == _OFFBOARD >> 16

    def set_parameter(self, encoder: Encoder, sysid: int, name: str, value: float) -> bytes:
        """Integers travel as their bytes (MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE)."""
        (raw,) = struct.unpack("<f", struct.pack("<i", int(value)))
        return encoder.param_set(sysid, name, raw, ParamType.INT32)

    def parameter(self, told: ParamValue) -> float:
        if told.param_type != ParamType.INT32:
            return told.value
        (number,) = struct.unpack("<i", struct.pack("<f", told.value))
        return float(number)

    def settings(self, station_sysid: int) -> tuple[Setting, ...]:
        del station_sysid  # any ground station may command it
        return (Setting(("NAV_DLL_ACT",), 1.0), Setting(("COM_OBL_RC_ACT",), 5.0))
