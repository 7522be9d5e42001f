"""What the station can order, as typed values. Only the shell turns them into bytes."""

from dataclasses import dataclass

from hil.mavlink import Encoder, RoverMode


@dataclass(frozen=True)
class Arm:
    sysid: int


@dataclass(frozen=True)
class SetMode:
    """MAV_CMD_DO_SET_MODE; HOLD means motors zero."""

    sysid: int
    mode: RoverMode


@dataclass(frozen=True)
class Drive:
    """SET_POSITION_TARGET_LOCAL_NED, velocity (NED, m/s) and, where given, yaw (rad)."""

    sysid: int
    time_s: float
    north_mps: float
    east_mps: float
    yaw_rad: float | None


@dataclass(frozen=True)
class Heartbeat:
    sysid: int


@dataclass(frozen=True)
class AskTime:
    """TIMESYNC request; `ts1_ns` is the station's clock and comes back mirrored."""

    sysid: int
    ts1_ns: int


Command = Arm | SetMode | Drive | Heartbeat | AskTime


def encode(command: Command, encoder: Encoder) -> bytes:
    """The one datagram that says `command`."""
    match command:
        case Arm(sysid):
            return encoder.arm(sysid)
        case SetMode(sysid, mode):
            return encoder.set_mode(sysid, mode)
        case Drive(sysid, time_s, north_mps, east_mps, yaw_rad):
            return encoder.velocity_setpoint(
                sysid, round(time_s * 1000), north_mps, east_mps, yaw_rad
            )
        case Heartbeat():
            return encoder.gcs_heartbeat()
        case AskTime(_, ts1_ns):
            return encoder.timesync(0, ts1_ns)
