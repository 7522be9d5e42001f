"""ArduPilot, Rover and Copter (tried with Rover 4.5-dev in simulation)."""

import math
from typing import ClassVar

from base_station.autopilots.adapter import Autopilot, Rate, Setting
from base_station.autopilots.heading import HeadingFirst
from base_station.receiving.telemetry import Status
from hil.frames import ned_to_body
from hil.mavlink import CopterMode, EkfFlag, Encoder, MessageId, RoverMode

CRUISE_SHARE = 0.7  # of the speed limit, where throttle is calibrated
STILL_MPS = 0.02
TUNED = (0.3, 0.3, 2.0, 1.0, 0.1, 2.0, math.radians(120), math.radians(120), 0.25, 0.2, 0.2)
_LOCATED = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_HORIZ | EkfFlag.POS_HORIZ_ABS


class ArduPilot(Autopilot):
    """Rover in GUIDED turns its nose to where it is sent, whatever its frame could do.

    It drops set-points without a word outside GUIDED and before its EKF has an origin, stops 3 s
    after the last velocity, and does not go back to GUIDED by itself after a failsafe.
    """

    NAME: ClassVar[str] = "ardupilot"
    drives_without_fix: ClassVar[bool] = False  # its EKF bounces between fix and accelerometer
    latency_s: ClassVar[float] = 0.1

    @property
    def helm(self) -> HeadingFirst | None:
        """CRUISE_THROTTLE over CRUISE_SPEED, ATC_SPEED_P, _I, ATC_ACCEL_MAX, MOT_SLEWRATE,
        ATC_STOP_SPEED, ATC_STR_ANG_P, _RAT_MAX, _ACC_MAX, _RAT_FF, _P, _I; Copter goes any way."""
        frame = self._frame
        if frame.flight is not None:
            return None
        motors = [frame.motors[i - 1] for i in frame.axis_motors("x")]
        free_mps = sum(m.free_speed_mps for m in motors) / len(motors)
        cruise_mps = CRUISE_SHARE * frame.speed_limit_mps
        rolling = frame.rolling_force_n / frame.axis_stall_force_n("x")
        return HeadingFirst(1.0 / free_mps + rolling / cruise_mps, *TUNED)

    @property
    def driven_mode(self) -> int:
        return int(CopterMode.GUIDED if self._frame.flight else RoverMode.GUIDED)

    @property
    def hold_mode(self) -> int:
        return int(CopterMode.LOITER if self._frame.flight else RoverMode.HOLD)

    def ready(self, status: Status) -> bool:
        """Pre-arm checks passed, and the EKF gives a position it believes in."""
        return status.prearm_ok and _is_located(status)

    def lost(self, status: Status) -> bool:
        """EKF_STATUS_REPORT has come, and has no position that it believes in."""
        return status.ekf_flags != 0 and not _is_located(status)

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
        No velocity would be one to the north, to which it turned: so it is told not to turn.
        """
        still = math.hypot(north_mps, east_mps) < STILL_MPS
        if yaw_rad is None and still and self.heading_first:
            return encoder.turning_setpoint(sysid, round(time_s * 1000), 0.0, 0.0)
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


def _is_located(status: Status) -> bool:
    flags = EkfFlag(status.ekf_flags & 0xFFFF)
    return flags & _LOCATED == _LOCATED and not flags & EkfFlag.CONST_POS_MODE
