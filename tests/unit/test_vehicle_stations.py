"""Several stations at once, signatures, and parameters that are kept."""

import itertools
from collections.abc import Callable
from pathlib import Path

import pytest
from vehicle_harness import Harness

from hil.errors import InputError
from hil.mavlink import (
    AutopilotVersion,
    CommandAck,
    Decoder,
    Encoder,
    Heartbeat,
    LocalPosition,
    Message,
    MessageId,
    MissionAck,
    MissionClearAll,
    ParamError,
    ParamFailed,
    ParamValue,
    Severity,
    Signing,
    StatusText,
    Streams,
    key_of,
)
from hil.scenario import Scenario
from sim_vehicles.parameter_file import restored, written
from sim_vehicles.parameters import rover_parameters
from sim_vehicles.process import ParameterKeeper
from sim_vehicles.vehicle import Vehicle

OTHER = Encoder(245, 190)


def heard(harness: Harness, peer: int, kind: type[Message]) -> int:
    datagrams = harness.vehicle.outbox("gcs", peer)
    return sum(isinstance(r.value, kind) for d in datagrams for r in Decoder().decode(d))


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.run(1.5)
    return harness


def test_answers_go_to_who_asked_and_texts_to_all(rover: Harness) -> None:
    vehicle = rover.vehicle
    rover.tell(rover.station.gcs_heartbeat())
    vehicle.receive("gcs", OTHER.arm(2), peer=1)
    assert heard(rover, 1, CommandAck) == 1
    vehicle.receive("gcs", OTHER.encode(MissionClearAll(2, 1)), peer=1)
    assert heard(rover, 1, MissionAck) == 1
    rover.run(0.1)
    assert rover.values(CommandAck) == []
    assert [t.text for t in rover.values(StatusText)] == ["Throttle armed"]


def test_each_station_has_streams_of_its_own(rover: Harness) -> None:
    vehicle = rover.vehicle
    rover.tell(rover.station.gcs_heartbeat())
    interval = OTHER.set_message_interval(2, MessageId.LOCAL_POSITION_NED, 2.0)
    vehicle.receive("gcs", interval, peer=1)
    rover.run(2.0)
    assert len(rover.values(LocalPosition)) == 20
    assert heard(rover, 1, LocalPosition) in (4, 5)


def test_sequence_numbers_are_counted_for_each_peer(rover: Harness) -> None:
    vehicle = rover.vehicle
    vehicle.receive("gcs", OTHER.gcs_heartbeat(), peer=1)
    rover.run(1.0)
    for datagrams in (vehicle.outbox("gcs", 1), rover.sent["gcs"]):
        sequence = [d[4] for d in datagrams]
        steps = {(b - a) % 256 for a, b in itertools.pairwise(sequence)}
        assert steps == {1}


def test_who_is_gone_is_forgotten(rover: Harness) -> None:
    vehicle = rover.vehicle
    vehicle.receive("gcs", OTHER.gcs_heartbeat(), peer=3)
    rover.run(1.0)
    vehicle.keep([0])
    assert heard(rover, 3, Heartbeat) == 0  # a new port has nothing to say yet
    assert rover.values(Heartbeat)


def test_with_a_key_only_signed_frames_count(rescue: Scenario) -> None:
    key = key_of("a pass phrase")
    sign: Callable[[int], Signing] = lambda link_id: Signing(key, link_id, lambda: 10**12)  # noqa: E731
    vehicle = Vehicle(rescue, 2, sign)
    for _ in range(3):
        vehicle.receive("gcs", OTHER.request_message(2, MessageId.AUTOPILOT_VERSION))
    (told,) = (r.value for d in vehicle.outbox("gcs") for r in Decoder(sign(0)).decode(d))
    assert told == StatusText(Severity.WARNING, "1 frames refused: not signed")
    signer = Encoder(245, 190, sign(7))
    asked = signer.request_message(2, MessageId.AUTOPILOT_VERSION)
    vehicle.receive("gcs", asked)
    answers = vehicle.outbox("gcs")
    assert len([r for d in answers for r in Decoder(sign(0)).decode(d)]) == 2
    vehicle.receive("gcs", asked)
    assert vehicle.outbox("gcs") == []


def test_what_one_station_has_signed_is_nobody_elses_to_say_again(rescue: Scenario) -> None:
    streams = Streams()
    key = key_of("a pass phrase")
    vehicle = Vehicle(rescue, 2, lambda link_id: Signing(key, link_id, lambda: 10**12, streams))
    signer = Encoder(250, 190, Signing(key, 7, lambda: 10**12))
    asked = signer.request_message(2, MessageId.AUTOPILOT_VERSION)
    vehicle.receive("gcs", asked)
    assert len(vehicle.outbox("gcs")) == 2
    vehicle.receive("gcs", asked, peer=1)
    (told,) = (r.value for d in vehicle.outbox("gcs", 1) for r in Decoder().decode(d))
    assert told == StatusText(Severity.WARNING, "1 frames refused: signed before")
    broken = Encoder(251, 190).inject_failure(2, 101, 1, 0)
    vehicle.receive("injector", broken)
    (told,) = (r.value for d in vehicle.outbox("injector") for r in Decoder().decode(d))
    assert told == StatusText(Severity.WARNING, "1 frames refused: not signed")


def test_a_parameter_switches_whether_unsigned_frames_count(rescue: Scenario) -> None:
    key = key_of("a pass phrase")
    sign: Callable[[int], Signing] = lambda link_id: Signing(key, link_id, lambda: 10**12)  # noqa: E731
    vehicle, signer = Vehicle(rescue, 2, sign), Encoder(245, 190, sign(7))

    def answers(datagram: bytes) -> list[type]:
        vehicle.receive("gcs", datagram)
        said = [r.value for d in vehicle.outbox("gcs") for r in Decoder(sign(0)).decode(d)]
        return [type(v) for v in said if not isinstance(v, StatusText)]

    unsigned = OTHER.request_message(2, MessageId.AUTOPILOT_VERSION)
    version = [CommandAck, AutopilotVersion]
    assert answers(unsigned) == []
    assert answers(OTHER.param_set(2, "MAV1_OPTIONS", 1.0)) == []  # nobody without the key opens it
    opened = signer.param_set(2, "MAV1_OPTIONS", 1.0)
    assert answers(opened) == [ParamValue]
    assert answers(unsigned) == version
    asked = signer.request_message(2, MessageId.AUTOPILOT_VERSION)
    assert answers(asked[:-1] + bytes([asked[-1] ^ 1])) == []  # what is signed must be so rightly
    assert answers(asked) == version
    assert answers(asked) == []
    assert answers(signer.param_set(2, "MAV1_OPTIONS", 0.0)) == [ParamValue]
    assert answers(unsigned) == []
    assert answers(opened) == []


def test_without_a_key_unsigned_frames_always_count(rover: Harness) -> None:
    assert rover.vehicle.parameters["MAV1_OPTIONS"] == 1.0
    rover.tell(rover.station.param_set(2, "MAV1_OPTIONS", 0.0))
    assert [p.error for p in rover.values(ParamFailed)] == [ParamError.READ_ONLY]
    assert rover.vehicle.hears_unsigned()


def test_changed_parameters_survive(rescue: Scenario, tmp_path: Path) -> None:
    path = tmp_path / "rover.parm"
    first = Harness(rescue)
    keeper = ParameterKeeper(path, first.vehicle)
    keeper.keep()
    assert not path.exists()
    first.tell(first.station.param_set(2, "FS_TIMEOUT", 7.5))
    first.tell(first.station.param_set(2, "FENCE_ACTION", 1.0))
    first.tell(first.station.param_set(2, "FENCE_ACTION", 99.0))
    keeper.keep()
    assert path.read_text() == "FENCE_ACTION 1\nFS_TIMEOUT 7.5\n"
    second = Harness(rescue)
    ParameterKeeper(path, second.vehicle)
    second.tell(second.station.param_request_read(2, "FS_TIMEOUT"))
    assert [p.value for p in second.values(ParamValue)] == [7.5]


def test_lines_that_cannot_be_followed_are_told(rescue: Scenario) -> None:
    parameters = rover_parameters(2, 250, rescue.vehicle(2).frame)
    lines = "# a comment\n\nFS_TIMEOUT,6\nNOPE 1\nFS_TIMEOUT\nFS_TIMEOUT nan\nSYSID_THISMAV 9\n"
    complaints = restored(parameters, lines)
    assert [c.split(":")[0] for c in complaints] == ["line 4", "line 5", "line 6", "line 7"]
    assert written(parameters) == "FS_TIMEOUT 6\n"


def test_an_unreadable_file_is_an_error_for_people(rescue: Scenario, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        ParameterKeeper(tmp_path, Vehicle(rescue, 2))
