"""Each microservice over the wire: one truthful answer to each question."""

from struct import Struct

import pytest
from vehicle_harness import STATION, Harness

from hil.mavlink import (
    AutopilotVersion,
    Command,
    CommandAck,
    CommandInt,
    CommandLong,
    FileTransfer,
    Heartbeat,
    HomePosition,
    LocalPosition,
    MessageId,
    MessageInterval,
    MissionAck,
    MissionClearAll,
    MissionCount,
    MissionRequestList,
    ParamError,
    ParamFailed,
    ParamRequestRead,
    ParamValue,
    Ping,
    RequestDataStream,
    Result,
    RoverMode,
    Sensor,
    SetMode,
    StatusText,
    SysStatus,
    Timesync,
)
from hil.scenario import Scenario


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.run(1.5)
    return harness


def acks(harness: Harness) -> list[tuple[int, int]]:
    return [(a.command, a.result) for a in harness.values(CommandAck)]


def test_identity(rover: Harness) -> None:
    beats = rover.values(Heartbeat)
    assert len(beats) == 2  # at 0 and 1 s
    beat = beats[-1]
    assert (beat.mav_type, beat.autopilot, beat.base_mode & 1) == (10, 3, 1)
    assert {(r.sysid, r.compid) for r in rover.received()} == {(2, 1)}


def test_telemetry_rates_and_times(rover: Harness) -> None:
    rover.tell(rover.station.gcs_heartbeat())
    rover.run(2.0)
    times = [p.time_s for p in rover.values(LocalPosition)]
    assert times == pytest.approx([1.5 + 0.1 * k for k in range(20)])


def test_health_bits_follow_readiness(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.run(2.1)
    before, *_, after = rover.values(SysStatus)
    assert not before.health & Sensor.PREARM_CHECK
    assert after.health & Sensor.PREARM_CHECK
    assert after.health & Sensor.GPS


@pytest.mark.parametrize("number", [0, 21, 22, 520, 521, 2000, 31000, 65535])
def test_every_command_gets_exactly_one_ack_for_its_sender(rover: Harness, number: int) -> None:
    for message in (
        CommandLong(2, 1, number, (0.0,) * 7),
        CommandInt(2, 1, 0, number, (0.0,) * 4, 0, 0, 0.0),
    ):
        rover.tell(rover.station.encode(message))
        (ack,) = rover.values(CommandAck)
        assert (ack.command, ack.target_sysid, ack.target_compid) == (number, STATION, 190)
        known = number == Command.REQUEST_AUTOPILOT_CAPABILITIES
        assert ack.result == (Result.ACCEPTED if known else Result.UNSUPPORTED)


@pytest.mark.parametrize("param", [float("nan"), float("inf"), 0.5, -1.0, 1e30])
@pytest.mark.parametrize("command", [c for c in Command if c is not Command.INJECT_FAILURE])
def test_senseless_params_get_one_ack_too(rover: Harness, command: int, param: float) -> None:
    rover.tell(rover.station.command_long(2, command, param, param))
    assert len(rover.values(CommandAck)) == 1


def test_commands_for_others_are_ignored(rover: Harness) -> None:
    assert rover.tell(rover.station.command_long(3, Command.REQUEST_MESSAGE, 148.0)) == []
    other_component = CommandLong(2, 42, Command.REQUEST_MESSAGE, (148.0, *(0.0,) * 6))
    assert rover.tell(rover.station.encode(other_component)) == []


def test_arming_is_refused_with_a_reason_until_ready(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.station.arm(2))
    assert acks(rover) == [(400, Result.FAILED)]
    assert "position" in rover.values(StatusText)[0].text
    rover.run(1.5)
    rover.tell(rover.station.arm(2))
    assert acks(rover) == [(400, Result.ACCEPTED)]


def test_emergency_stop(rover: Harness) -> None:
    rover.guided()
    rover.run(1.0, (0.5, 0.0))
    rover.tell(rover.station.command_long(2, Command.COMPONENT_ARM_DISARM, 0.0, 21196.0))
    assert acks(rover) == [(400, Result.ACCEPTED)]
    rover.run(0.1)
    assert rover.pwm == (0,) * 16


def test_both_ways_to_set_a_mode(rover: Harness) -> None:
    rover.tell(rover.station.set_mode(2, RoverMode.GUIDED))
    assert acks(rover) == [(176, Result.ACCEPTED)]
    rover.tell(rover.station.encode(SetMode(2, RoverMode.MANUAL)))
    rover.run(1.0)
    assert rover.values(Heartbeat)[-1].custom_mode == RoverMode.MANUAL


def test_request_message_gives_ack_and_message(rover: Harness) -> None:
    for number, kind in (
        (MessageId.AUTOPILOT_VERSION, AutopilotVersion),
        (MessageId.HOME_POSITION, HomePosition),
        (MessageId.HEARTBEAT, Heartbeat),
    ):
        answers = rover.tell(rover.station.request_message(2, number))
        assert [type(a.value) for a in answers] == [CommandAck, kind]
        assert acks(rover) == [(512, Result.ACCEPTED)]


def test_a_message_that_is_not_there_is_not_promised(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.tell(rover.station.request_message(2, MessageId.HOME_POSITION))
    assert acks(rover) == [(512, Result.TEMPORARILY_REJECTED)]
    rover.tell(rover.station.request_message(2, 435))
    assert acks(rover) == [(512, Result.UNSUPPORTED)]


@pytest.mark.parametrize(("hz", "expected"), [(50.0, 50), (5.0, 5), (0.0, 0)])
def test_message_intervals(rover: Harness, hz: float, expected: int) -> None:
    rover.tell(rover.station.set_message_interval(2, MessageId.ATTITUDE, hz))
    assert acks(rover) == [(511, Result.ACCEPTED)]
    rover.tell(rover.station.command_long(2, Command.GET_MESSAGE_INTERVAL, 30.0))
    assert rover.values(MessageInterval)[0].interval_us == (1e6 / hz if hz else -1)
    rover.tell(rover.station.gcs_heartbeat())
    rover.run(1.0)
    count = sum(type(r.value).__name__ == "Attitude" for r in rover.received())
    assert abs(count - expected) <= 1


def test_the_old_way_to_set_rates(rover: Harness) -> None:
    rover.tell(rover.station.encode(RequestDataStream(2, 1, 6, 2, True)))
    rover.run(2.0)
    assert len(rover.values(LocalPosition)) in (4, 5)


def test_the_old_way_to_stop_streams_leaves_the_heartbeat(rover: Harness) -> None:
    rover.tell(rover.station.encode(RequestDataStream(2, 1, 0, 4, False)))
    rover.run(2.0)
    assert not rover.values(LocalPosition)
    assert len(rover.values(Heartbeat)) == 2


def test_parameters_list_read_and_set(rover: Harness) -> None:
    rover.tell(rover.station.param_request_list(2))
    listed = rover.values(ParamValue)
    assert [p.index for p in listed] == list(range(len(listed)))
    assert {p.count for p in listed} == {len(listed)}
    rover.tell(rover.station.encode(ParamRequestRead(2, 1, "", 3)))
    assert rover.values(ParamValue) == [listed[3]]
    rover.tell(rover.station.param_set(2, "FS_TIMEOUT", 7.0))
    assert rover.values(ParamValue)[0].value == 7.0
    rover.tell(rover.station.param_request_read(2, "FS_TIMEOUT"))
    assert rover.values(ParamValue)[0].value == 7.0


@pytest.mark.parametrize(
    ("name", "value", "error"),
    [
        ("NOPE", 1.0, ParamError.DOES_NOT_EXIST),
        ("SIM_GPS1_STUCK", 1.0, ParamError.DOES_NOT_EXIST),
        ("FS_TIMEOUT", 1e9, ParamError.VALUE_OUT_OF_RANGE),
        ("SYSID_THISMAV", 9.0, ParamError.READ_ONLY),
    ],
)
def test_parameters_that_cannot_be_set(
    rover: Harness, name: str, value: float, error: ParamError
) -> None:
    rover.tell(rover.station.param_set(2, name, value))
    assert [f.error for f in rover.values(ParamFailed)] == [error]
    assert all(p.value != value for p in rover.values(ParamValue))


def test_integer_parameters_are_cut_as_by_c(rover: Harness) -> None:
    rover.tell(rover.station.param_set(2, "FS_GCS_ENABLE", 0.9))
    assert rover.values(ParamValue)[0].value == 0.0


def test_timesync_mirrors_the_question_and_tells_vehicle_time(rover: Harness) -> None:
    answers = rover.tell(rover.station.timesync(0, 123456789))
    assert [a.value for a in answers] == [Timesync(1_480_000_000, 123456789)]
    assert rover.tell(rover.station.timesync(5, 6)) == []


def test_ping(rover: Harness) -> None:
    (answer,) = rover.tell(rover.station.encode(Ping(77, 3, 0, 0)))
    assert answer.value == Ping(77, 3, STATION, 190)


def test_ftp_is_refused_at_once(rover: Harness) -> None:
    header = Struct("<HBBBBBBI")
    request = header.pack(9, 0, 4, 18, 0, 0, 0, 0) + b"@PARAM/param.pck"
    (answer,) = rover.tell(rover.station.encode(FileTransfer(2, 1, request)))
    assert isinstance(answer.value, FileTransfer)
    sequence, _, opcode, size, asked, *_ = header.unpack_from(answer.value.payload)
    assert (sequence, opcode, size, asked, answer.value.payload[12]) == (10, 129, 1, 4, 10)


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_missions_fences_and_rally_points_are_empty(rover: Harness, kind: int) -> None:
    (answer,) = rover.tell(rover.station.encode(MissionRequestList(2, 1, kind)))
    assert answer.value == MissionCount(STATION, 190, 0, kind)
    (answer,) = rover.tell(rover.station.encode(MissionClearAll(2, 1, kind)))
    assert answer.value == MissionAck(STATION, 190, 0, kind)
