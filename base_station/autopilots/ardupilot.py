"""ArduPilot, Rover and Copter (tried with Rover 4.5-dev in simulation)."""

from typing import ClassVar

from base_station.autopilots.adapter import Autopilot, Rate, Setting
from base_station.receiving.telemetry import Status
from hil.frames import ned_to_body
from hil.mavlink import CopterMode, EkfFlag, Encoder, MessageId, RoverMode

_LOCATED = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_HORIZ | EkfFlag.POS_HORIZ_ABS


class ArduPilot(Autopilot):
    """Rover in GUIDED turns its nose to where it is sent, whatever its frame could do.

    It drops set-points without a word outside GUIDED and before its EKF has an origin, stops 3 s
    after the last velocity, and does not go back to GUIDED by itself after a failsafe.
    """

    NAME: ClassVar[str] = "ardupilot"

    @property
    def heading_first(self) -> bool:
        return self._frame.flight is None  # Copter goes any way

    @property
    def driven_mode(self) -> int:
        return int(CopterMode.GUIDED if self._frame.flight else RoverMode.GUIDED)

    @property
    def hold_mode(self) -> int:
        return int(CopterMode.LOITER if self._frame.flight else RoverMode.HOLD)

    def ready(self, status: Status) -> bool:
        """Pre-arm checks passed, and the EKF gives a position it believes in."""
        flags = EkfFlag(status.ekf_flags & 0xFFFF)
        located = flags & _LOCATED == _LOCATED and not flags & EkfFlag.CONST_POS_MODE
        return status.prearm_ok and located

    def velocity(
        self,
        encoder: Encoder,
        sysid: int,
        time_s: float,
        north_mps: float,
        east_mps: float,
        yaw_rad: float | None,
    ) -> bytes:
        """With a yaw, Rover drives along that heading, backwards where the first component is < 0.

        It takes the sign from there in whatever frame, so the speed along the heading goes there.
        """
        if yaw_rad is not None and self.heading_first:
            ahead, _ = ned_to_body(north_mps, east_mps, yaw_rad)
            north_mps, east_mps = ahead, 0.0
        return super().velocity(encoder, sysid, time_s, north_mps, east_mps, yaw_rad)

    def rates(self, telemetry_hz: float) -> tuple[Rate, ...]:
        return (*super().rates(telemetry_hz), Rate(MessageId.EKF_STATUS_REPORT, 2.0))

    def settings(self, station_sysid: int) -> tuple[Setting, ...]:
        """Its ground station, and HOLD (Copter: RTL) when the heartbeats of that end."""
        return (
            Setting(("MAV_GCS_SYSID", "SYSID_MYGCS"), float(station_sysid)),
            Setting(("FS_GCS_ENABLE",), 1.0),
        )
