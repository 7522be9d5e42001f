"""What the station can order, as typed values. Only the shell turns them into bytes."""

from dataclasses import dataclass

from base_station.autopilots import Autopilot
from hil.mavlink import Encoder, MessageId


@dataclass(frozen=True)
class Arm:
    """MAV_CMD_COMPONENT_ARM_DISARM; disarming is the emergency stop, and forced."""

    sysid: int
    armed: bool = True


@dataclass(frozen=True)
class SetMode:
    """MAV_CMD_DO_SET_MODE; `mode` is the custom mode that the heartbeat should then carry."""

    sysid: int
    mode: int


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


@dataclass(frozen=True)
class AskRate:
    """MAV_CMD_SET_MESSAGE_INTERVAL."""

    sysid: int
    message: MessageId
    hz: float


@dataclass(frozen=True)
class RequestMessage:
    """MAV_CMD_REQUEST_MESSAGE."""

    sysid: int
    message: MessageId


@dataclass(frozen=True)
class SetParameter:
    """PARAM_SET; the vehicle says what it has then."""

    sysid: int
    name: str
    value: float


Command = AskRate | RequestMessage | SetParameter | Arm | SetMode | Drive | Heartbeat | AskTime


def encode(command: Command, encoder: Encoder, autopilot: Autopilot) -> bytes:
    """The one datagram that says `command` to a vehicle with that autopilot."""
    match command:
        case Arm(sysid, armed):
            return encoder.arm(sysid) if armed else encoder.emergency_stop(sysid)
        case SetMode(sysid, mode):
            return autopilot.set_mode(encoder, sysid, mode)
        case Drive(sysid, time_s, north_mps, east_mps, yaw_rad):
            return autopilot.velocity(encoder, sysid, time_s, north_mps, east_mps, yaw_rad)
        case Heartbeat():
            return encoder.gcs_heartbeat()
        case AskRate(sysid, message, hz):
            return encoder.set_message_interval(sysid, message, hz)
        case RequestMessage(sysid, message):
            return encoder.request_message(sysid, message)
        case SetParameter(sysid, name, value):
            return autopilot.set_parameter(encoder, sysid, name, value)
        case AskTime(_, ts1_ns):
            return encoder.timesync(0, ts1_ns)
