"""Missions, fences and rally points: over the wire, and driven."""

import math
from dataclasses import replace

import pytest
from vehicle_harness import STATION, Harness

from hil.frames import ned_to_wgs84
from hil.mavlink import (
    Command,
    CommandAck,
    Encoder,
    FenceStatus,
    Heartbeat,
    MessageId,
    MissionAck,
    MissionClearAll,
    MissionCount,
    MissionCurrent,
    MissionItem,
    MissionItemReached,
    MissionRequest,
    MissionRequestInt,
    MissionRequestList,
    MissionResult,
    MissionSetCurrent,
    MissionState,
    MissionType,
    Result,
    RoverMode,
    StatusText,
)
from hil.scenario import Scenario

Point = tuple[float, float]
NAN = math.nan
SQUARE = [(3.0, 3.0), (3.0, -3.0), (-3.0, -3.0), (-3.0, 3.0)]
INCLUSION = Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.run(1.5)
    return harness


def item(
    rescue: Scenario,
    seq: int,
    point: Point,
    command: int = Command.NAV_WAYPOINT,
    kind: int = MissionType.MISSION,
    p1: float = 0.0,
    p2: float = 0.0,
) -> MissionItem:
    lat, lon = ned_to_wgs84(*point, rescue.origin.origin())
    place = (round(lat * 1e7), round(lon * 1e7), 0.0)
    params = (p1, p2, NAN, 0.0)
    return MissionItem(2, 1, seq, 6, command, params, *place, mission_type=kind)


def way(rescue: Scenario, *points: Point) -> list[MissionItem]:
    """Home, and way-points after it."""
    return [item(rescue, seq, point) for seq, point in enumerate([(0.0, 0.0), *points])]


def upload(rover: Harness, items: list[MissionItem], kind: int = MissionType.MISSION) -> int:
    """The whole conversation; returns the result of the ACK."""
    (answer,) = rover.tell(rover.station.encode(MissionCount(2, 1, len(items), kind)))
    while isinstance(answer.value, MissionRequestInt):
        asked = answer.value
        assert (asked.target_sysid, asked.target_compid, asked.mission_type) == (STATION, 190, kind)
        (answer,) = rover.tell(rover.station.encode(items[asked.seq]))
    assert isinstance(answer.value, MissionAck)
    assert answer.value.mission_type == kind
    return answer.value.result


def download(rover: Harness, kind: int = MissionType.MISSION) -> list[MissionItem]:
    (answer,) = rover.tell(rover.station.encode(MissionRequestList(2, 1, kind)))
    assert isinstance(answer.value, MissionCount)
    items = []
    for seq in range(answer.value.count):
        (got,) = rover.tell(rover.station.encode(MissionRequestInt(2, 1, seq, kind)))
        assert isinstance(got.value, MissionItem)
        items.append(got.value)
    return items


def texts(rover: Harness) -> list[str]:
    return [t.text for t in rover.values(StatusText)]


def auto(rover: Harness) -> None:
    rover.tell(rover.station.arm(2))
    rover.tell(rover.station.command_long(2, Command.MISSION_START))
    assert [a.result for a in rover.values(CommandAck)] == [Result.ACCEPTED]


def test_what_goes_up_comes_down_and_item_0_is_home(rescue: Scenario, rover: Harness) -> None:
    items = way(rescue, (1.0, 0.0), (1.0, 2.0))
    assert upload(rover, items) == MissionResult.ACCEPTED
    home, *rest = download(rover)
    expected = [
        replace(i, target_sysid=STATION, target_compid=190, params=(0.0,) * 4, current=i.seq == 1)
        for i in items[1:]
    ]
    assert rest == expected
    assert (home.frame, home.command) == (0, Command.NAV_WAYPOINT)
    assert home.x == pytest.approx(items[0].x, abs=20)
    (old,) = rover.tell(rover.station.encode(MissionRequest(2, 1, 2)))
    assert old.value == expected[1]


def test_three_lists_side_by_side(rescue: Scenario, rover: Harness) -> None:
    fence = [
        item(rescue, i, p, INCLUSION, MissionType.FENCE, 4.0) for i, p in enumerate(SQUARE)
    ] + [item(rescue, 4, (1.0, 1.0), Command.NAV_FENCE_CIRCLE_EXCLUSION, MissionType.FENCE, 0.5)]
    rally = [item(rescue, 0, (1.0, 1.0), Command.NAV_RALLY_POINT, MissionType.RALLY)]
    assert upload(rover, fence, MissionType.FENCE) == MissionResult.ACCEPTED
    assert upload(rover, rally, MissionType.RALLY) == MissionResult.ACCEPTED
    assert upload(rover, way(rescue, (1.0, 0.0))) == MissionResult.ACCEPTED
    assert [len(download(rover, k)) for k in (0, 1, 2)] == [2, 5, 1]
    assert [i.x for i in download(rover, 1)] == [i.x for i in fence]
    rover.tell(rover.station.encode(MissionClearAll(2, 1, MissionType.FENCE)))
    assert [len(download(rover, k)) for k in (0, 1, 2)] == [2, 0, 1]
    rover.tell(rover.station.encode(MissionClearAll(2, 1, MissionType.ALL)))
    assert [len(download(rover, k)) for k in (0, 1, 2)] == [0, 0, 0]


@pytest.mark.parametrize(
    ("change", "result"),
    [
        ({"command": 4242}, MissionResult.UNSUPPORTED),
        ({"command": INCLUSION}, MissionResult.UNSUPPORTED),
        ({"frame": 1}, MissionResult.UNSUPPORTED_FRAME),
        ({"params": (math.inf, 0.0, 0.0, 0.0)}, MissionResult.INVALID_PARAM1),
        ({"params": (0.0, -math.inf, 0.0, 0.0)}, MissionResult.INVALID_PARAM2),
        ({"params": (0.0, 0.0, 3e38, 3e38)}, MissionResult.ACCEPTED),
        ({"params": (0.0, 0.0, math.inf, 0.0)}, MissionResult.INVALID),
        ({"x": 2**31 - 1}, MissionResult.INVALID_PARAM5_X),
        ({"x": 0}, MissionResult.INVALID_PARAM5_X),
        ({"y": -(2**31)}, MissionResult.INVALID_PARAM6_Y),
        ({"z": math.inf}, MissionResult.INVALID_PARAM7),
        ({"z": NAN, "params": (NAN,) * 4}, MissionResult.ACCEPTED),
    ],
)
def test_items_that_make_no_sense_are_refused_and_the_old_list_stays(
    rescue: Scenario, rover: Harness, change: dict[str, object], result: MissionResult
) -> None:
    assert upload(rover, way(rescue, (1.0, 0.0), (2.0, 0.0))) == MissionResult.ACCEPTED
    good = item(rescue, 1, (2.0, 0.0))
    bad = replace(good, **change)  # type: ignore[arg-type]
    assert upload(rover, [*way(rescue), bad]) == result
    assert len(download(rover)) == (2 if result is MissionResult.ACCEPTED else 3)


@pytest.mark.parametrize("corners", [2, 5, 0, -1, 1e9, NAN])
def test_fences_cut_short_are_refused(rescue: Scenario, rover: Harness, corners: float) -> None:
    items = [
        item(rescue, i, p, INCLUSION, MissionType.FENCE, corners) for i, p in enumerate(SQUARE)
    ]
    assert upload(rover, items, MissionType.FENCE) == MissionResult.INVALID


def test_lists_that_are_not_there(rover: Harness) -> None:
    for message in (
        MissionRequestList(2, 1, 9),
        MissionClearAll(2, 1, 9),
        MissionCount(2, 1, 1, 9),
    ):
        (answer,) = rover.tell(rover.station.encode(message))
        assert answer.value == MissionAck(STATION, 190, MissionResult.UNSUPPORTED, 9)
    (answer,) = rover.tell(rover.station.encode(MissionRequestInt(2, 1, 0)))
    assert answer.value == MissionAck(STATION, 190, MissionResult.INVALID_SEQUENCE, 0)
    (answer,) = rover.tell(rover.station.encode(MissionCount(2, 1, 60000)))
    assert answer.value == MissionAck(STATION, 190, MissionResult.NO_SPACE, 0)


def test_a_lost_item_is_asked_for_again_and_a_lost_sender_is_given_up(rover: Harness) -> None:
    rover.tell(rover.station.encode(MissionCount(2, 1, 3)))
    rover.run(3.5)
    asked = [r for r in rover.values(MissionRequestInt) if r.seq == 0]
    assert len(asked) == 4
    rover.run(6.0)
    assert "Mission upload timeout" in texts(rover)
    assert rover.values(MissionAck)[0].result == MissionResult.OPERATION_CANCELLED


def test_repeated_and_early_items_do_no_harm(rescue: Scenario, rover: Harness) -> None:
    first, second = way(rescue, (1.0, 0.0))
    rover.tell(rover.station.encode(MissionCount(2, 1, 2)))
    assert rover.tell(rover.station.encode(second)) == []
    (asked,) = rover.tell(rover.station.encode(first))
    assert asked.value == MissionRequestInt(STATION, 190, 1)
    assert rover.tell(rover.station.encode(first)) == []
    (ack,) = rover.tell(rover.station.encode(second))
    assert ack.value == MissionAck(STATION, 190, MissionResult.ACCEPTED)


def test_two_stations_do_not_upload_at_once(rescue: Scenario, rover: Harness) -> None:
    other = Encoder(245, 190)
    rover.tell(rover.station.encode(MissionCount(2, 1, 2)))
    (answer,) = rover.tell(other.encode(MissionCount(2, 1, 2)))
    assert answer.value == MissionAck(245, 190, MissionResult.DENIED)
    (answer,) = rover.tell(other.encode(item(rescue, 0, (0.0, 0.0))))
    assert answer.value == MissionAck(245, 190, MissionResult.DENIED)
    rover.tell(rover.station.encode(MissionAck(2, 1, MissionResult.OPERATION_CANCELLED)))
    (answer,) = rover.tell(other.encode(MissionCount(2, 1, 2)))
    assert isinstance(answer.value, MissionRequestInt)


def test_auto_without_a_mission_is_refused_with_the_reason(rover: Harness) -> None:
    rover.tell(rover.station.set_mode(2, RoverMode.AUTO))
    assert [a.result for a in rover.values(CommandAck)] == [Result.FAILED]
    assert texts(rover) == ["Mode AUTO: no mission"]


def test_a_mission_is_driven_item_by_item(rescue: Scenario, rover: Harness) -> None:
    x, y = rover.position_m
    assert upload(rover, way(rescue, (x + 1.5, y), (x + 1.5, y + 1.0))) == MissionResult.ACCEPTED
    rover.run(1.0)
    assert rover.values(MissionCurrent)[-1] == MissionCurrent(1, 2, MissionState.NOT_STARTED)
    auto(rover)
    rover.run(10.0)
    assert [r.seq for r in rover.values(MissionItemReached)] == [1, 2]
    assert texts(rover)[-1] == "Mission Complete"
    currents = [(c.seq, c.state) for c in rover.values(MissionCurrent)]
    assert currents[0] == (1, MissionState.ACTIVE)
    assert currents[-1] == (2, MissionState.COMPLETE)
    assert rover.position_m == pytest.approx([x + 1.5, y + 1.0], abs=0.15)
    assert rover.values(Heartbeat)[-1].custom_mode == RoverMode.AUTO


def test_way_points_wait_radii_speed_delay_and_home(rescue: Scenario, rover: Harness) -> None:
    x, y = rover.position_m
    start, slow, wait, first, back = (
        item(rescue, 0, (0.0, 0.0)),
        item(rescue, 1, (0.0, 0.0), Command.DO_CHANGE_SPEED, p2=0.4),
        item(rescue, 2, (0.0, 0.0), Command.NAV_DELAY, p1=1.0),
        item(rescue, 3, (x + 2.0, y), p1=2.0, p2=0.5),
        item(rescue, 4, (0.0, 0.0), Command.NAV_RETURN_TO_LAUNCH),
    )
    assert upload(rover, [start, slow, wait, first, back]) == MissionResult.ACCEPTED
    auto(rover)
    rover.run(0.9)
    assert rover.position_m == pytest.approx([x, y], abs=0.05)
    rover.run(2.0)
    assert math.hypot(*rover.velocity_mps) == pytest.approx(0.4, abs=0.1)
    rover.run(3.5)
    assert [r.seq for r in rover.values(MissionItemReached)] == [1, 2]
    rover.run(12.0)
    assert [r.seq for r in rover.values(MissionItemReached)] == [1, 2, 3, 4]
    assert rover.position_m == pytest.approx([x, y], abs=0.3)


def test_a_mission_pauses_and_goes_on_and_can_be_set(rescue: Scenario, rover: Harness) -> None:
    x, y = rover.position_m
    upload(rover, way(rescue, (x + 1.0, y), (x + 2.0, y), (x, y)))
    auto(rover)
    rover.run(3.0)
    rover.tell(rover.station.set_mode(2, RoverMode.HOLD))
    rover.run(2.0)
    assert rover.values(MissionCurrent)[-1].state == MissionState.PAUSED
    (answer,) = rover.tell(rover.station.encode(MissionSetCurrent(2, 1, 3)))
    assert answer.value == MissionCurrent(3, 3, MissionState.NOT_STARTED)
    (refused,) = rover.tell(rover.station.encode(MissionSetCurrent(2, 1, 9)))
    assert isinstance(refused.value, StatusText)
    for seq, result in ((2.0, Result.ACCEPTED), (9.0, Result.DENIED), (NAN, Result.DENIED)):
        rover.tell(rover.station.command_long(2, Command.DO_SET_MISSION_CURRENT, seq))
        assert [a.result for a in rover.values(CommandAck)] == [result]
    rover.tell(rover.station.set_mode(2, RoverMode.AUTO))
    rover.run(6.0)
    assert [r.seq for r in rover.values(MissionItemReached)] == [2, 3]


def test_clearing_a_running_mission_stops_it(rescue: Scenario, rover: Harness) -> None:
    x, y = rover.position_m
    upload(rover, way(rescue, (x + 5.0, y)))
    auto(rover)
    rover.run(2.0)
    rover.tell(rover.station.encode(MissionClearAll(2, 1)))
    rover.run(2.0)
    assert math.hypot(*rover.velocity_mps) < 0.05


def test_rtl_goes_to_the_nearest_of_home_and_rally_points(rescue: Scenario, rover: Harness) -> None:
    x, y = rover.position_m
    rover.guided()
    rover.run(4.0, (0.5, 0.0))
    rally = item(rescue, 0, (x + 2.0, y + 1.0), Command.NAV_RALLY_POINT, MissionType.RALLY)
    upload(rover, [rally], MissionType.RALLY)
    rover.tell(rover.station.set_mode(2, RoverMode.RTL))
    rover.run(8.0)
    assert rover.position_m == pytest.approx([x + 2.0, y + 1.0], abs=0.15)
    rover.tell(rover.station.encode(MissionClearAll(2, 1, MissionType.RALLY)))
    rover.run(8.0)
    assert rover.position_m == pytest.approx([x, y], abs=0.15)


@pytest.mark.parametrize(("action", "mode"), [(2, RoverMode.HOLD), (0, RoverMode.GUIDED)])
def test_a_breach_of_the_fence_acts(
    rescue: Scenario, rover: Harness, action: int, mode: RoverMode
) -> None:
    x, y = rover.position_m
    square = [(x + n, y + e) for n, e in SQUARE]
    items = [item(rescue, i, p, INCLUSION, MissionType.FENCE, 4.0) for i, p in enumerate(square)]
    upload(rover, items, MissionType.FENCE)
    rover.tell(rover.station.command_long(2, Command.DO_FENCE_ENABLE, 1.0))
    rover.tell(rover.station.param_set(2, "FENCE_ACTION", float(action)))
    rover.guided()
    rover.run(3.0, (0.8, 0.0))
    assert not texts(rover)
    rover.run(3.0, (0.8, 0.0))
    assert rover.values(Heartbeat)[-1].custom_mode == mode
    named = {2: "Fence Breach: Hold", 0: "Fence Breach: Report"}
    assert named[action] in texts(rover)
    rover.tell(rover.station.request_message(2, MessageId.FENCE_STATUS))
    (status,) = rover.values(FenceStatus)
    assert (status.breached, status.breach_count) == (True, 1)
    rover.tell(rover.station.arm(2, False))
    rover.tell(rover.station.arm(2))
    assert "Arm: vehicle outside fence" in texts(rover)


def test_a_fence_around_home_brings_the_vehicle_back(rover: Harness) -> None:
    x, y = rover.position_m
    rover.tell(rover.station.param_set(2, "FENCE_RADIUS", 1.0))
    rover.tell(rover.station.param_set(2, "FENCE_ENABLE", 1.0))
    rover.tell(rover.station.param_set(2, "FENCE_ACTION", 1.0))
    rover.guided()
    rover.run(8.0, (0.6, 0.0))
    assert "Fence Breach: Rtl" in texts(rover)
    assert "Fence Breach Cleared" in texts(rover)
    rover.run(4.0)
    assert rover.position_m == pytest.approx([x, y], abs=0.15)


def test_enabling_nothing_is_refused(rover: Harness) -> None:
    rover.tell(rover.station.param_set(2, "FENCE_TYPE", 4.0))
    for wanted, result in ((1.0, Result.FAILED), (0.0, Result.ACCEPTED), (7.0, Result.DENIED)):
        rover.tell(rover.station.command_long(2, Command.DO_FENCE_ENABLE, wanted))
        assert [a.result for a in rover.values(CommandAck)] == [result]
