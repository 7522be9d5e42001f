"""The MAVLink and ArduPilot numbers this project uses, by their names (a test compares them)."""

from enum import IntEnum, IntFlag

AUTOPILOT_ARDUPILOT = 3  # MAV_AUTOPILOT_ARDUPILOTMEGA
AUTOPILOT_INVALID = 8  # MAV_AUTOPILOT_INVALID: not an autopilot, as a ground station says
TYPE_GCS = 6  # MAV_TYPE_GCS
TYPE_ROVER = 10  # MAV_TYPE_GROUND_ROVER
COMPONENT_AUTOPILOT = 1  # MAV_COMP_ID_AUTOPILOT1
COMPONENT_GCS = 190  # MAV_COMP_ID_MISSIONPLANNER
MODE_FLAG_CUSTOM = 1  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
MODE_FLAG_GUIDED = 8  # MAV_MODE_FLAG_GUIDED_ENABLED
MODE_FLAG_MANUAL = 64  # MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
MODE_FLAG_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
FORCE_DISARM_MAGIC = 21196  # COMPONENT_ARM_DISARM param2: disarm whatever the state is


class RoverMode(IntEnum):
    """ArduPilot Rover's custom modes."""

    MANUAL = 0
    ACRO = 1
    STEERING = 3
    HOLD = 4
    LOITER = 5
    AUTO = 10
    RTL = 11
    SMART_RTL = 12
    GUIDED = 15
    INITIALISING = 16


class SystemStatus(IntEnum):
    """MAV_STATE."""

    BOOT = 1
    CALIBRATING = 2
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5


class Severity(IntEnum):
    """MAV_SEVERITY of a STATUSTEXT."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class Result(IntEnum):
    """MAV_RESULT of a COMMAND_ACK."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5


class Command(IntEnum):
    """MAV_CMD, the part of it this project sends or answers."""

    DO_SET_MODE = 176
    COMPONENT_ARM_DISARM = 400
    GET_HOME_POSITION = 410
    INJECT_FAILURE = 420
    GET_MESSAGE_INTERVAL = 510
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    REQUEST_AUTOPILOT_CAPABILITIES = 520


class MessageId(IntEnum):
    """Message ids, by MAVLink's names."""

    HEARTBEAT = 0
    SYS_STATUS = 1
    PING = 4
    SET_MODE = 11
    PARAM_REQUEST_READ = 20
    PARAM_REQUEST_LIST = 21
    PARAM_VALUE = 22
    PARAM_SET = 23
    GPS_RAW_INT = 24
    ATTITUDE = 30
    LOCAL_POSITION_NED = 32
    GLOBAL_POSITION_INT = 33
    SERVO_OUTPUT_RAW = 36
    MISSION_CURRENT = 42
    MISSION_REQUEST_LIST = 43
    MISSION_COUNT = 44
    MISSION_CLEAR_ALL = 45
    MISSION_ACK = 47
    GPS_GLOBAL_ORIGIN = 49
    REQUEST_DATA_STREAM = 66
    COMMAND_INT = 75
    COMMAND_LONG = 76
    COMMAND_ACK = 77
    SET_POSITION_TARGET_LOCAL_NED = 84
    FILE_TRANSFER_PROTOCOL = 110
    TIMESYNC = 111
    BATTERY_STATUS = 147
    AUTOPILOT_VERSION = 148
    HOME_POSITION = 242
    MESSAGE_INTERVAL = 244
    EXTENDED_SYS_STATE = 245
    STATUSTEXT = 253
    PARAM_ERROR = 345


class Frame(IntEnum):
    """MAV_FRAME of local set-points."""

    LOCAL_NED = 1
    LOCAL_OFFSET_NED = 7
    BODY_NED = 8
    BODY_OFFSET_NED = 9


class TypeMask(IntFlag):
    """POSITION_TARGET_TYPEMASK: a set bit means that the field is ignored."""

    X = 1
    Y = 2
    Z = 4
    VX = 8
    VY = 16
    VZ = 32
    AX = 64
    AY = 128
    AZ = 256
    FORCE = 512
    YAW = 1024
    YAW_RATE = 2048
    POSITION = X | Y | Z
    VELOCITY = VX | VY | VZ
    ACCELERATION = AX | AY | AZ


class Sensor(IntFlag):
    """MAV_SYS_STATUS_SENSOR bits of SYS_STATUS."""

    GYRO = 1
    ACCEL = 2
    MAG = 4
    GPS = 32
    YAW_POSITION = 4096
    XY_POSITION_CONTROL = 16384
    MOTOR_OUTPUTS = 32768
    AHRS = 2097152
    BATTERY = 33554432
    PREARM_CHECK = 268435456


class Capability(IntFlag):
    """MAV_PROTOCOL_CAPABILITY bits of AUTOPILOT_VERSION."""

    PARAM_FLOAT = 2
    COMMAND_INT = 8
    SET_POSITION_TARGET_LOCAL_NED = 128
    MAVLINK2 = 8192
    PARAM_ENCODE_C_CAST = 131072


class FixType(IntEnum):
    """GPS_FIX_TYPE."""

    NO_FIX = 1
    FIX_3D = 3
    RTK_FIXED = 6


class ParamType(IntEnum):
    """MAV_PARAM_TYPE; ArduPilot casts integers to float as C does."""

    INT8 = 2
    INT16 = 4
    INT32 = 6
    REAL32 = 9


class ParamError(IntEnum):
    """MAV_PARAM_ERROR: why a parameter was not read or set."""

    DOES_NOT_EXIST = 1
    VALUE_OUT_OF_RANGE = 2
    PERMISSION_DENIED = 3
    READ_ONLY = 5


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT of a MISSION_ACK."""

    ACCEPTED = 0
    UNSUPPORTED = 3
    NO_SPACE = 4
