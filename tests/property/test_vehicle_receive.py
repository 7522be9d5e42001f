"""Whatever arrives, a vehicle goes on as if it had not, and still answers: rover and quadcopter."""

import math
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from vehicle_harness import Harness, Hovering

from hil.mavlink import (
    Command,
    CommandAck,
    CommandInt,
    CopterMode,
    Encoder,
    GlobalSetpoint,
    LocalSetpoint,
    ManualControl,
    MessageId,
    MissionCount,
    MissionItem,
    RoverMode,
)
from hil.scenario import load_scenario

RESCUE = Path(__file__).parents[2] / "scenarios" / "rescue.yaml"
SCENARIO = load_scenario(RESCUE)
FLIGHT = load_scenario(RESCUE, ["fleet.1.airframe=quad_x", "yaw=free", "faults=[]"])
KINDS = ("rover", "quad")
EITHER = pytest.mark.parametrize("kind", KINDS)
STATION = Encoder(250, 190)
COMMANDS = {
    "rover": [
        STATION.arm(2, False),
        STATION.set_mode(2, 4),
        STATION.velocity_setpoint(2, 0, 1, 1, 0),
    ],
    "quad": [
        STATION.command_long(2, Command.NAV_LAND),
        STATION.set_mode(2, CopterMode.LAND),
        STATION.velocity_setpoint(2, 0, 1, 1, 0),
    ],
}
NOT_NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf, 1e30, -3e38])


def vehicle(kind: str) -> Harness:
    return Harness(SCENARIO) if kind == "rover" else Hovering(FLIGHT)


def driven(kind: str, *noise: bytes) -> tuple[tuple[int, ...], list[bytes]]:
    """Outputs and telemetry of a drive or flight, with `noise` received in the middle of it."""
    subject = vehicle(kind)
    subject.guided()
    subject.run(0.2, (0.3, 0.2))
    for datagram in noise:
        subject.vehicle.receive("gcs", datagram)
        subject.vehicle.receive("injector", datagram)
    subject.run(0.2)
    subject.run(0.1, (0.3, 0.2))
    return subject.pwm, subject.datagrams["gcs"]


UNDISTURBED = {kind: driven(kind) for kind in KINDS}


@EITHER
def test_good_frames_do_change_something(kind: str) -> None:
    assert all(driven(kind, command) != UNDISTURBED[kind] for command in COMMANDS[kind])


@EITHER
@settings(max_examples=40, deadline=None)
@given(st.lists(st.binary(max_size=300), max_size=4))
def test_random_bytes_change_nothing(kind: str, datagrams: list[bytes]) -> None:
    assert driven(kind, *datagrams) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2), st.data())
def test_truncated_and_broken_frames_change_nothing(
    kind: str, which: int, data: st.DataObject
) -> None:
    frame = COMMANDS[kind][which]
    cut = frame[: data.draw(st.integers(0, len(frame) - 1))]
    at = data.draw(st.integers(len(frame) - 2, len(frame) - 1))
    wrong = frame[:at] + bytes([frame[at] ^ data.draw(st.integers(1, 255))]) + frame[at + 1 :]
    signed = wrong[:2] + b"\1" + wrong[3:] + bytes(13)
    assert driven(kind, cut, wrong, signed) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=20, deadline=None)
@given(st.integers(1, 255).filter(lambda n: n != 2), st.integers(0, 2))
def test_frames_for_other_systems_change_nothing(kind: str, target: int, which: int) -> None:
    others = (
        STATION.arm(target, False),
        STATION.set_mode_message(target, RoverMode.HOLD if kind == "rover" else CopterMode.LAND),
        STATION.command_long(target, Command.NAV_LAND),
    )
    assert driven(kind, others[which]) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=40, deadline=None)
@given(NOT_NUMBERS, st.integers(0, 3), st.sampled_from([1, 7, 8, 9]))
def test_set_points_that_are_no_numbers_or_absurd_are_refused(
    kind: str, bad: float, field: int, frame: int
) -> None:
    place = (bad, 0.0, 0.0)
    values = [(place, None, None, None), (None, place, None, None)]
    values += [(None, (0.1, 0.1, 0.0), bad, None), (None, (0.1, 0.1, 0.0), None, bad)]
    position, velocity, yaw, rate = values[field]
    mask = (7 if position is None else 0) | (56 if velocity is None else 0)
    mask |= (1024 if yaw is None else 0) | (2048 if rate is None else 0) | 448
    setpoint = LocalSetpoint(2, 1, 0.0, frame, mask, position, velocity, yaw, rate)
    assert driven(kind, STATION.encode(setpoint)) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=20, deadline=None)
@given(st.integers(0, 255).filter(lambda f: f not in (1, 7, 8, 9)))
def test_unknown_frames_are_refused(kind: str, frame: int) -> None:
    setpoint = LocalSetpoint(2, 1, 0.0, frame, 3527, None, (0.5, 0.5, 0.0), None, None)
    assert driven(kind, STATION.encode(setpoint)) == UNDISTURBED[kind]


@EITHER
def test_a_flood_of_heartbeats_changes_nothing(kind: str) -> None:
    assert driven(kind, *[STATION.gcs_heartbeat()] * 5000) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 65535),
    st.lists(st.floats(width=32), min_size=7, max_size=7),
    st.sampled_from(["gcs", "injector"]),
)
def test_any_command_gets_one_ack_and_the_vehicle_goes_on(
    kind: str, number: int, params: list[float], port: str
) -> None:
    subject = vehicle(kind)
    subject.run(0.1)
    assert port in ("gcs", "injector")
    command = STATION.command_long(2, number, *params)
    answers = subject.tell(command, "gcs" if port == "gcs" else "injector")
    assert [r.value.command for r in answers if isinstance(r.value, CommandAck)] == [number]
    subject.run(0.1)
    answers = subject.tell(STATION.request_message(2, MessageId.AUTOPILOT_VERSION))
    assert len(answers) == 2


@EITHER
@settings(max_examples=40, deadline=None)
@given(NOT_NUMBERS, st.integers(0, 2), st.sampled_from([0, 3, 5, 6, 10, 11, 1, 99]))
def test_global_set_points_that_cannot_be_meant_are_refused(
    kind: str, bad: float, field: int, frame: int
) -> None:
    velocity, yaw, rate = ((bad if field == k else 0.1) for k in range(3))
    motion = (0.1, velocity, 0.0)
    setpoint = GlobalSetpoint(2, 1, 0.0, frame, 7 | 448, None, motion, yaw, rate)
    assert driven(kind, STATION.encode(setpoint)) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=20, deadline=None)
@given(st.floats(-90, 90), st.floats(-180, 180))
def test_points_on_the_other_side_of_the_globe_are_refused(
    kind: str, lat: float, lon: float
) -> None:
    assume(abs(lat - 47.4) > 2.0)
    setpoint = GlobalSetpoint(2, 1, 0.0, 6, 3576, (lat, lon, 0.0), None, None, None)
    assert driven(kind, STATION.encode(setpoint)) == UNDISTURBED[kind]


@EITHER
@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(-1000, 1000), min_size=4, max_size=4), st.integers(0, 255))
def test_sticks_move_nothing_outside_manual(kind: str, axes: list[int], target: int) -> None:
    x, y, z, r = (a / 1000 for a in axes)
    assert driven(kind, STATION.encode(ManualControl(target, x, y, z, r))) == UNDISTURBED[kind]


ITEMS = st.builds(
    MissionItem,
    target_sysid=st.just(2),
    target_compid=st.just(1),
    seq=st.integers(0, 3),
    frame=st.sampled_from([0, 3, 6, 1, 200]),
    command=st.sampled_from([16, 17, 20, 93, 178, 5001, 5003, 5100, 0, 65535]),
    params=st.tuples(*[st.floats(width=32)] * 4),
    x=st.one_of(st.integers(-(2**31), 2**31 - 1), st.just(473977420)),
    y=st.one_of(st.integers(-(2**31), 2**31 - 1), st.just(85455940)),
    z=st.floats(width=32),
    mission_type=st.sampled_from([0, 0, 1, 2, 255, 9]),
)


@EITHER
@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.one_of(
            ITEMS,
            st.builds(MissionCount, st.just(2), st.just(1), st.integers(0, 4), st.integers(0, 3)),
        ),
        max_size=12,
    )
)
def test_whatever_is_uploaded_the_vehicle_drives_on(kind: str, messages: list[MissionItem]) -> None:
    subject = vehicle(kind)
    subject.guided()
    for list_type in (0, 1, 2):
        subject.tell(STATION.encode(MissionCount(2, 1, 2, list_type)))
        for message in messages:
            subject.tell(STATION.encode(message))
    subject.tell(STATION.param_set(2, "FENCE_ENABLE", 1.0))
    subject.tell(STATION.set_mode(2, RoverMode.AUTO if kind == "rover" else CopterMode.AUTO))
    subject.run(0.3)
    assert all(0 <= p <= 1900 for p in subject.pwm)
    assert all(math.isfinite(p) for p in subject.position_m)
    answers = subject.tell(STATION.request_message(2, MessageId.AUTOPILOT_VERSION))
    assert len(answers) == 2


@EITHER
@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from([int(c) for c in Command]),
    st.lists(st.floats(width=32), min_size=5, max_size=5),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(0, 255),
)
def test_any_command_int_gets_one_ack(
    kind: str, number: int, numbers: list[float], x: int, y: int, frame: int
) -> None:
    subject = vehicle(kind)
    subject.run(0.1)
    p1, p2, p3, p4, z = numbers
    command = CommandInt(2, 1, frame, number, (p1, p2, p3, p4), x, y, z)
    answers = subject.tell(STATION.encode(command))
    assert [r.value.command for r in answers if isinstance(r.value, CommandAck)] == [number]
    subject.run(0.1)
