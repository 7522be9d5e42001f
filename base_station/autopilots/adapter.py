"""What the station asks of any autopilot: modes, set-points, rates, settings, readiness."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from base_station.autopilots.heading import HeadingFirst
from base_station.receiving.telemetry import Status
from hil.airframe import Airframe
from hil.mavlink import CommandLong, Encoder, MessageId, ParamValue


@dataclass(frozen=True)
class Rate:
    """A message the station lives on, and how often it wants it."""

    message: MessageId
    hz: float


@dataclass(frozen=True)
class Setting:
    """A parameter that must have a value before the station drives. `names` newest first."""

    names: tuple[str, ...]
    value: float


class Autopilot(ABC):
    """One kind of autopilot in one airframe. Pure: bytes and values, no links, no clock."""

    NAME: ClassVar[str]
    has_own_origin: ClassVar[bool] = True  # local NED begins somewhere of the vehicle's own
    needs_setpoints_first: ClassVar[bool] = False  # the driven mode is refused without a stream
    response: ClassVar[str] = "first_order"  # how speed follows a set-point, for `hil identify`
    drives_without_fix: ClassVar[bool] = True  # to a velocity, when its receiver is stuck
    latency_s: ClassVar[float] = 0.0  # of its own, from a set-point to what it does about it
    estimate_lags: ClassVar[bool] = False  # no accelerometer in it: raw fixes are truer
    setpoint_timeout_s: ClassVar[float] = 3.0  # it stops by itself after the last set-point

    def __init__(self, frame: Airframe) -> None:
        self._frame = frame

    @property
    def helm(self) -> HeadingFirst | None:
        """How it drives when it turns its nose to where it is sent, whatever its frame could do."""
        return None

    @property
    def heading_first(self) -> bool:
        return self.helm is not None

    @property
    @abstractmethod
    def driven_mode(self) -> int:
        """The custom mode in which it follows set-points from a ground station."""

    @property
    @abstractmethod
    def hold_mode(self) -> int:
        """The custom mode in which it stands, or stays where it is in the air."""

    @abstractmethod
    def ready(self, status: Status) -> bool:
        """Whether it says that it may be armed and knows where it is."""

    def lost(self, status: Status) -> bool:
        """Whether it says that it does not know where it is any more."""
        del status
        return False

    def set_mode(self, encoder: Encoder, sysid: int, mode: int) -> bytes:
        """MAV_CMD_DO_SET_MODE with `mode` as a heartbeat would carry it."""
        return encoder.set_mode(sysid, mode)

    def drives(self, command: CommandLong) -> bool:
        """Whether a MAV_CMD_DO_SET_MODE asks for the driven mode."""
        return int(command.params[1]) == self.driven_mode

    def velocity(
        self,
        encoder: Encoder,
        sysid: int,
        time_s: float,
        north_mps: float,
        east_mps: float,
        yaw_rad: float | None,
    ) -> bytes:
        """SET_POSITION_TARGET_LOCAL_NED: velocity, and yaw where it is commanded."""
        return encoder.velocity_setpoint(sysid, round(time_s * 1000), north_mps, east_mps, yaw_rad)

    def rates(self, telemetry_hz: float) -> tuple[Rate, ...]:
        """What to ask for by MAV_CMD_SET_MESSAGE_INTERVAL; empty where it comes unasked."""
        return (
            Rate(MessageId.LOCAL_POSITION_NED, telemetry_hz),
            Rate(MessageId.ATTITUDE, telemetry_hz),
            Rate(MessageId.SERVO_OUTPUT_RAW, telemetry_hz / 2.0),
            Rate(MessageId.SYS_STATUS, 1.0),
            Rate(MessageId.GPS_RAW_INT, 2.0),
        )

    def set_parameter(self, encoder: Encoder, sysid: int, name: str, value: float) -> bytes:
        """PARAM_SET as this autopilot understands numbers."""
        return encoder.param_set(sysid, name, value)

    def parameter(self, told: ParamValue) -> float:
        """The number that a PARAM_VALUE of this autopilot carries."""
        return told.value

    def settings(self, station_sysid: int) -> tuple[Setting, ...]:
        """What to set and read back, so that the vehicle stops when its station is gone."""
        del station_sysid
        return ()
