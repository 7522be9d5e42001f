"""Every number written down here is the one MAVLink's own dialect has."""

from enum import IntEnum, IntFlag

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from hil import mavlink

PREFIXES: list[tuple[type[IntEnum | IntFlag], str]] = [
    (mavlink.CopterMode, "COPTER_MODE_"),
    (mavlink.SystemStatus, "MAV_STATE_"),
    (mavlink.Severity, "MAV_SEVERITY_"),
    (mavlink.Result, "MAV_RESULT_"),
    (mavlink.MessageId, "MAVLINK_MSG_ID_"),
    (mavlink.ParamType, "MAV_PARAM_TYPE_"),
    (mavlink.ParamError, "MAV_PARAM_ERROR_"),
    (mavlink.Capability, "MAV_PROTOCOL_CAPABILITY_"),
    (mavlink.MissionResult, "MAV_MISSION_"),
    (mavlink.MissionState, "MISSION_STATE_"),
    (mavlink.MissionType, "MAV_MISSION_TYPE_"),
    (mavlink.GlobalFrame, "MAV_FRAME_"),
    (mavlink.EkfFlag, "EKF_"),
]
RENAMED = {
    "FIX_3D": "GPS_FIX_TYPE_3D_FIX",
    "NO_FIX": "GPS_FIX_TYPE_NO_FIX",
    "RTK_FIXED": "GPS_FIX_TYPE_RTK_FIXED",
    "TYPE_GCS": "MAV_TYPE_GCS",
    "TYPE_ROVER": "MAV_TYPE_GROUND_ROVER",
    "AUTOPILOT_ARDUPILOT": "MAV_AUTOPILOT_ARDUPILOTMEGA",
    "AUTOPILOT_INVALID": "MAV_AUTOPILOT_INVALID",
    "COMPONENT_AUTOPILOT": "MAV_COMP_ID_AUTOPILOT1",
    "COMPONENT_GCS": "MAV_COMP_ID_MISSIONPLANNER",
    "MODE_FLAG_CUSTOM": "MAV_MODE_FLAG_CUSTOM_MODE_ENABLED",
    "MODE_FLAG_GUIDED": "MAV_MODE_FLAG_GUIDED_ENABLED",
    "MODE_FLAG_MANUAL": "MAV_MODE_FLAG_MANUAL_INPUT_ENABLED",
    "MODE_FLAG_ARMED": "MAV_MODE_FLAG_SAFETY_ARMED",
}


@pytest.mark.parametrize(
    ("member", "name"), [(m, prefix + m.name) for enum, prefix in PREFIXES for m in enum]
)
def test_enum_members(member: IntEnum, name: str) -> None:
    assert getattr(ardupilotmega, name) == int(member)


@pytest.mark.parametrize("command", mavlink.Command)
def test_commands(command: mavlink.Command) -> None:
    name = ardupilotmega.enums["MAV_CMD"].get(int(command))
    assert command is mavlink.Command.INJECT_FAILURE or name.name == f"MAV_CMD_{command.name}"


@pytest.mark.parametrize(("ours", "theirs"), RENAMED.items())
def test_constants(ours: str, theirs: str) -> None:
    value = getattr(mavlink, ours, None)
    value = mavlink.FixType[ours] if value is None else value
    assert getattr(ardupilotmega, theirs) == value


@pytest.mark.parametrize("mode", mavlink.RoverMode)
def test_rover_modes(mode: mavlink.RoverMode) -> None:
    later = {mavlink.RoverMode.INITIALISING: "ROVER_MODE_INITIALIZING"}
    assert getattr(ardupilotmega, later.get(mode, f"ROVER_MODE_{mode.name}")) == mode


def test_sensor_bits() -> None:
    names = {"GYRO": "3D_GYRO", "ACCEL": "3D_ACCEL", "MAG": "3D_MAG"}
    for sensor in mavlink.Sensor:
        short = names.get(sensor.name or "", sensor.name)
        candidates = (f"MAV_SYS_STATUS_SENSOR_{short}", f"MAV_SYS_STATUS_{short}")
        assert int(sensor) in [getattr(ardupilotmega, n, None) for n in candidates]
