"""Typed values against MAVLink's reference library: same fields, right units, both ways."""

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as reference

from hil import mavlink
from hil.mavlink import Decoder, Encoder, Message

# our value, the reference's message, and its fields with units as MAVLink has them
CASES: list[tuple[Message, str, dict[str, Any]]] = [
    (
        mavlink.Heartbeat(10, 3, True, 15, 4),
        "HEARTBEAT",
        {"type": 10, "autopilot": 3, "base_mode": 129, "custom_mode": 15, "system_status": 4},
    ),
    (
        mavlink.SysStatus(35, 33, 1, 0.25, 24.5, 1.5, 93),
        "SYS_STATUS",
        {
            "onboard_control_sensors_present": 35,
            "onboard_control_sensors_enabled": 33,
            "onboard_control_sensors_health": 1,
            "load": 250,
            "voltage_battery": 24500,
            "current_battery": 150,
            "battery_remaining": 93,
        },
    ),
    (
        mavlink.GpsRaw(1.5, 6, 47.3977423, 8.5455945, 488.123, 0.7, 1.25, math.pi / 2, 18),
        "GPS_RAW_INT",
        {
            "time_usec": 1_500_000,
            "fix_type": 6,
            "lat": 473977423,
            "lon": 85455945,
            "alt": 488123,
            "eph": 70,
            "vel": 125,
            "cog": 9000,
            "satellites_visible": 18,
        },
    ),
    (
        mavlink.GlobalPosition(2.0, 47.0, -8.5, 488.0, -0.5, (1.0, -0.5, 0.25), math.pi),
        "GLOBAL_POSITION_INT",
        {
            "time_boot_ms": 2000,
            "lat": 470000000,
            "lon": -85000000,
            "alt": 488000,
            "relative_alt": -500,
            "vx": 100,
            "vy": -50,
            "vz": 25,
            "hdg": 18000,
        },
    ),
    (
        mavlink.LocalPosition(2.02, (1.0, -2.0, 0.5), (0.25, -0.125, 0.0)),
        "LOCAL_POSITION_NED",
        {"time_boot_ms": 2020, "x": 1.0, "y": -2.0, "z": 0.5, "vx": 0.25, "vy": -0.125, "vz": 0.0},
    ),
    (
        mavlink.Attitude(1.0, 0.125, -0.25, 1.5, 0.5, -0.5, 0.75),
        "ATTITUDE",
        {
            "roll": 0.125,
            "pitch": -0.25,
            "yaw": 1.5,
            "rollspeed": 0.5,
            "pitchspeed": -0.5,
            "yawspeed": 0.75,
        },
    ),
    (
        mavlink.ServoOutputs(1.0, (1100, 1900, *(0,) * 6, 1500, *(0,) * 7)),
        "SERVO_OUTPUT_RAW",
        {"time_usec": 1_000_000, "port": 0, "servo1_raw": 1100, "servo2_raw": 1900}
        | {"servo8_raw": 0, "servo9_raw": 1500},
    ),
    (
        mavlink.Battery(24.5, 1.5, 120.0, 98),
        "BATTERY_STATUS",
        {
            "current_consumed": 120,
            "voltages": [24500, *[65535] * 9],
            "current_battery": 150,
            "battery_remaining": 98,
        },
    ),
    (
        mavlink.HomePosition(47.5, 8.5, 488.0, (1.0, 2.0, -0.5)),
        "HOME_POSITION",
        {"latitude": 475000000, "longitude": 85000000, "altitude": 488000}
        | {"x": 1.0, "y": 2.0, "z": -0.5, "q": [1.0, 0.0, 0.0, 0.0]},
    ),
    (
        mavlink.GpsOrigin(47.5, 8.5, 488.0),
        "GPS_GLOBAL_ORIGIN",
        {"latitude": 475000000, "longitude": 85000000, "altitude": 488000},
    ),
    (mavlink.StatusText(4, "a text"), "STATUSTEXT", {"severity": 4, "text": "a text"}),
    (
        mavlink.AutopilotVersion(8192, (4, 6, 0, 255), 7),
        "AUTOPILOT_VERSION",
        {"capabilities": 8192, "flight_sw_version": 0x040600FF, "uid": 7},
    ),
    (mavlink.ExtendedSysState(1), "EXTENDED_SYS_STATE", {"landed_state": 1}),
    (mavlink.MissionCurrent(0, 0), "MISSION_CURRENT", {"seq": 0, "total": 0, "mission_state": 1}),
    (
        mavlink.CommandAck(400, 4, 250, 190),
        "COMMAND_ACK",
        {"command": 400, "result": 4, "target_system": 250, "target_component": 190},
    ),
    (mavlink.Timesync(5, -7), "TIMESYNC", {"tc1": 5, "ts1": -7}),
    (
        mavlink.Ping(1, 2, 3, 4),
        "PING",
        {"time_usec": 1, "seq": 2, "target_system": 3, "target_component": 4},
    ),
    (
        mavlink.ParamValue("FS_TIMEOUT", 5.0, 3, 20),
        "PARAM_VALUE",
        {"param_id": "FS_TIMEOUT", "param_value": 5.0, "param_index": 3, "param_count": 20},
    ),
    (
        mavlink.ParamFailed(250, 190, "NOPE", -1, 1),
        "PARAM_ERROR",
        {"param_id": "NOPE", "param_index": -1, "error": 1, "target_system": 250},
    ),
    (
        mavlink.MessageInterval(32, 100_000),
        "MESSAGE_INTERVAL",
        {"message_id": 32, "interval_us": 100_000},
    ),
    (
        mavlink.CommandLong(2, 1, 420, (101.0, 1.0, 3.0, 0.0, 5.0, 6.0, 7.0), 1),
        "COMMAND_LONG",
        {"target_system": 2, "target_component": 1, "command": 420, "confirmation": 1}
        | {"param1": 101.0, "param3": 3.0, "param7": 7.0},
    ),
    (
        mavlink.CommandInt(2, 1, 6, 192, (1.0, 2.0, 3.0, 4.0), -5, 6, 7.0),
        "COMMAND_INT",
        {"frame": 6, "command": 192, "param4": 4.0, "x": -5, "y": 6, "z": 7.0},
    ),
    (mavlink.SetMode(2, 4), "SET_MODE", {"target_system": 2, "custom_mode": 4, "base_mode": 1}),
    (
        mavlink.ParamSet(2, 1, "WP_SPEED", 0.5, 9),
        "PARAM_SET",
        {"target_system": 2, "param_id": "WP_SPEED", "param_value": 0.5, "param_type": 9},
    ),
    (
        mavlink.ParamRequestRead(2, 1, "WP_SPEED", -1),
        "PARAM_REQUEST_READ",
        {"param_id": "WP_SPEED", "param_index": -1, "target_component": 1},
    ),
    (mavlink.ParamRequestList(2, 1), "PARAM_REQUEST_LIST", {"target_system": 2}),
    (
        mavlink.RequestDataStream(2, 1, 6, 10, True),
        "REQUEST_DATA_STREAM",
        {"req_stream_id": 6, "req_message_rate": 10, "start_stop": 1},
    ),
    (mavlink.MissionRequestList(2, 1, 1), "MISSION_REQUEST_LIST", {"mission_type": 1}),
    (mavlink.MissionClearAll(2, 1, 2), "MISSION_CLEAR_ALL", {"mission_type": 2}),
    (mavlink.MissionCount(2, 1, 9, 0), "MISSION_COUNT", {"count": 9, "target_system": 2}),
    (mavlink.MissionAck(2, 1, 3, 0), "MISSION_ACK", {"type": 3, "target_system": 2}),
    (mavlink.MissionRequestInt(2, 1, 4, 1), "MISSION_REQUEST_INT", {"seq": 4, "mission_type": 1}),
    (mavlink.MissionRequest(2, 1, 4, 1), "MISSION_REQUEST", {"seq": 4, "target_component": 1}),
    (
        mavlink.MissionItem(
            2, 1, 3, 6, 16, (1.0, 2.0, 3.0, 4.0), -473977423, 85455945, 5.0, True, False, 2
        ),
        "MISSION_ITEM_INT",
        {"seq": 3, "frame": 6, "command": 16, "param1": 1.0, "param4": 4.0, "x": -473977423}
        | {"y": 85455945, "z": 5.0, "current": 1, "autocontinue": 0, "mission_type": 2},
    ),
    (mavlink.MissionSetCurrent(2, 1, 3), "MISSION_SET_CURRENT", {"seq": 3, "target_system": 2}),
    (mavlink.MissionItemReached(3), "MISSION_ITEM_REACHED", {"seq": 3}),
    (
        mavlink.GlobalSetpoint(2, 1, 1.5, 6, 0, (47.5, -8.5, 3.0), (1.0, -2.0, 0.5), 0.25, -0.5),
        "SET_POSITION_TARGET_GLOBAL_INT",
        {"time_boot_ms": 1500, "lat_int": 475000000, "lon_int": -85000000, "alt": 3.0, "vx": 1.0}
        | {"vy": -2.0, "vz": 0.5, "yaw": 0.25, "yaw_rate": -0.5, "coordinate_frame": 6},
    ),
    (
        mavlink.ManualControl(2, 0.5, -1.0, None, 0.0, 3),
        "MANUAL_CONTROL",
        {"x": 500, "y": -1000, "z": 32767, "r": 0, "buttons": 3, "target": 2},
    ),
    (
        mavlink.RcOverride(2, 1, (1500, 65535, 1900, 0, *(65535,) * 4, 7, *(0,) * 9)),
        "RC_CHANNELS_OVERRIDE",
        {"chan1_raw": 1500, "chan2_raw": 65535, "chan3_raw": 1900, "chan9_raw": 7},
    ),
    (
        mavlink.RcChannels(1.5, (1500, 1600, 1700, 1800)),
        "RC_CHANNELS",
        {"time_boot_ms": 1500, "chancount": 4, "chan4_raw": 1800, "chan5_raw": 65535},
    ),
    (
        mavlink.RawImu(1.5, (0.0, 9.80665, -9.80665), (0.25, -0.5, 0.0), (0.2, 0.0, 0.4)),
        "RAW_IMU",
        {"time_usec": 1_500_000, "yacc": 1000, "zacc": -1000, "xgyro": 250, "zmag": 400},
    ),
    (
        mavlink.ScaledImu(1.5, (0.0, 9.80665, -9.80665), (0.25, -0.5, 0.0), (0.2, 0.0, 0.4)),
        "SCALED_IMU",
        {"time_boot_ms": 1500, "yacc": 1000, "zacc": -1000, "ygyro": -500, "xmag": 200},
    ),
    (
        mavlink.EkfStatus(0.25, 0.5, 0.125, 0.0, 831),
        "EKF_STATUS_REPORT",
        {"velocity_variance": 0.25, "pos_horiz_variance": 0.5, "flags": 831},
    ),
    (
        mavlink.EscTelemetry(
            (mavlink.Esc(1200, 24.5, 1.5, 30, 40, 7), *(mavlink.Esc(0, 0.0, 0.0, 0, 0, 0),) * 3)
        ),
        "ESC_TELEMETRY_1_TO_4",
        {"rpm": [1200, 0, 0, 0], "voltage": [2450, 0, 0, 0], "current": [150, 0, 0, 0]}
        | {"totalcurrent": [30, 0, 0, 0], "temperature": [40, 0, 0, 0], "count": [7, 0, 0, 0]},
    ),
    (
        mavlink.VfrHud(1.5, 488.0, -0.25, math.pi / 2, 0.5),
        "VFR_HUD",
        {"groundspeed": 1.5, "alt": 488.0, "climb": -0.25, "heading": 90, "throttle": 50},
    ),
    (
        mavlink.FenceStatus(True, 3, 1.5),
        "FENCE_STATUS",
        {"breach_time": 1500, "breach_count": 3, "breach_status": 1},
    ),
    (
        mavlink.FileTransfer(2, 1, bytes(range(251))),
        "FILE_TRANSFER_PROTOCOL",
        {"target_system": 2, "target_network": 0, "payload": list(range(251))},
    ),
]


@pytest.mark.parametrize(("value", "name", "fields"), CASES, ids=[c[1] for c in CASES])
def test_the_reference_reads_what_we_write(
    value: Message, name: str, fields: dict[str, Any]
) -> None:
    message = reference.MAVLink(None).decode(bytearray(Encoder(7, 1).encode(value)))
    assert (message.get_type(), message.get_srcSystem(), message.get_srcComponent()) == (name, 7, 1)
    assert {field: getattr(message, field) for field in fields} == fields


@pytest.mark.parametrize(("value", "name", "fields"), CASES, ids=[c[1] for c in CASES])
def test_we_read_what_the_reference_writes(
    value: Message, name: str, fields: dict[str, Any]
) -> None:
    theirs = reference.MAVLink(None, srcSystem=7, srcComponent=1)
    message = theirs.decode(bytearray(Encoder(7, 1).encode(value)))
    for version_1 in (False, True):
        datagram = message.pack(theirs, force_mavlink1=version_1 and message.id < 256)
        (received,) = Decoder().decode(bytes(datagram))
        assert received == mavlink.Received(7, 1, value)
    assert name == message.get_type()
    assert fields


def test_every_typed_message_has_a_case() -> None:
    typed = {c for c in vars(mavlink).values() if isinstance(c, type) and issubclass(c, Message)}
    assert typed - {Message, mavlink.LocalSetpoint} == {type(value) for value, _, _ in CASES}


def test_a_message_without_a_type_is_named() -> None:
    theirs = reference.MAVLink(None, srcSystem=7, srcComponent=1)
    datagram = reference.MAVLink_system_time_message(1, 2).pack(theirs)
    assert Decoder().decode(datagram) == [mavlink.Received(7, 1, mavlink.Other("SYSTEM_TIME"))]
