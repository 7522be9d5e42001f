"""A quadcopter on its own: missions with heights, the way home, set-points, landing."""

import math
from collections.abc import Callable

import pytest
from vehicle_world import InWorld, scenario

from hil.airframe import QUAD_X
from hil.frames import ned_to_wgs84
from hil.mavlink import (
    Command,
    CommandAck,
    CommandInt,
    CopterMode,
    GlobalFrame,
    GlobalSetpoint,
    Heartbeat,
    LocalSetpoint,
    MessageId,
    MissionAck,
    MissionCount,
    MissionItem,
    MissionItemReached,
    MissionResult,
    Result,
    StatusText,
    VfrHud,
)

NAN = float("nan")
RELATIVE, ABOVE_SEA = GlobalFrame.GLOBAL_RELATIVE_ALT_INT, GlobalFrame.GLOBAL_INT
POSITION_ALONE, WITHOUT_HEIGHT = 3576, 3580


def ordered(world: InWorld, command: int, *params: float) -> int:
    world.clear()
    world.tell(world.station.command_long(1, command, *params))
    return world.sent(CommandAck)[-1].result


def ready(airframe: str = "quad_x") -> InWorld:
    world = InWorld(scenario(airframe))
    world.guided()
    return world


@pytest.fixture
def quad() -> InWorld:
    """At 3 m."""
    world = ready()
    assert ordered(world, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 3.0) == Result.ACCEPTED
    world.run(8.0)
    return world


def on_globe(world: InWorld, north_m: float, east_m: float) -> tuple[int, int]:
    lat, lon = ned_to_wgs84(north_m, east_m, world.scenario.origin.origin())
    return round(lat * 1e7), round(lon * 1e7)


def upload(world: InWorld, *rows: tuple[int, int, tuple[int, int], float]) -> int:
    """Rows of frame, command, place, altitude; home goes before them."""
    world.clear()
    world.tell(world.station.encode(MissionCount(1, 1, len(rows) + 1)))
    home = (int(RELATIVE), int(Command.NAV_WAYPOINT), on_globe(world, 0.0, 0.0), 0.0)
    for seq, (frame, command, (x, y), z) in enumerate((home, *rows)):
        item = MissionItem(1, 1, seq, frame, command, (0.0,) * 4, x, y, z)
        world.tell(world.station.encode(item))
    return world.sent(MissionAck)[-1].result


def until(world: InWorld, holds: Callable[[], bool], within_s: float = 60.0) -> None:
    for _ in range(round(within_s / 0.5)):
        if holds():
            return
        world.run(0.5)
    raise AssertionError(f"not within {within_s} s; at {world.truth()}")


def is_at(world: InWorld, north_m: float, east_m: float, height_m: float) -> bool:
    v = world.truth()
    return math.dist((v.north_m, v.east_m, -v.down_m), (north_m, east_m, height_m)) < 0.4


def is_down(world: InWorld) -> bool:
    return world.truth().down_m == 0.0 and not world.sent(Heartbeat)[-1].armed


def test_a_mission_from_the_ground_to_the_ground() -> None:
    world = ready()
    alt_m = world.scenario.origin.origin().alt_m
    result = upload(
        world,
        (RELATIVE, Command.NAV_TAKEOFF, (0, 0), 4.0),
        (RELATIVE, Command.NAV_WAYPOINT, on_globe(world, 4.0, 0.0), 6.0),
        (ABOVE_SEA, Command.NAV_WAYPOINT, on_globe(world, 4.0, 3.0), alt_m + 3.0),
        (RELATIVE, Command.NAV_LAND, on_globe(world, 2.0, 3.0), 0.0),
    )
    assert result == MissionResult.ACCEPTED
    assert ordered(world, Command.MISSION_START) == Result.ACCEPTED
    until(world, lambda: is_at(world, 4.0, 0.0, 6.0))
    until(world, lambda: is_at(world, 4.0, 3.0, 3.0))
    until(world, lambda: is_down(world))
    assert [m.seq for m in world.sent(MissionItemReached)] == [1, 2, 3, 4]
    assert {h.custom_mode for h in world.sent(Heartbeat)[1:]} == {CopterMode.AUTO}
    assert "Mission Complete" in [t.text for t in world.sent(StatusText)]
    assert math.dist((world.truth().north_m, world.truth().east_m), (2.0, 3.0)) < 0.5


def test_a_mission_may_touch_down_and_go_on() -> None:
    world = ready()
    upload(
        world,
        (RELATIVE, Command.NAV_TAKEOFF, (0, 0), 2.0),
        (RELATIVE, Command.NAV_LAND, (0, 0), 0.0),
        (RELATIVE, Command.NAV_TAKEOFF, (0, 0), 3.0),
        (RELATIVE, Command.NAV_RETURN_TO_LAUNCH, (0, 0), 0.0),
    )
    assert ordered(world, Command.MISSION_START) == Result.ACCEPTED
    until(world, lambda: is_at(world, 0.0, 0.0, 3.0))
    until(world, lambda: is_down(world))
    assert [m.seq for m in world.sent(MissionItemReached)] == [1, 2, 3, 4]


def test_a_rover_takes_no_items_of_the_air() -> None:
    row = (RELATIVE, Command.NAV_TAKEOFF, (0, 0), 2.0)
    assert upload(ready("omni_plus"), row) == MissionResult.UNSUPPORTED
    absurd = (RELATIVE, Command.NAV_TAKEOFF, (0, 0), 1e30)
    assert upload(ready(), absurd) == MissionResult.INVALID_PARAM7


def test_return_rises_flies_home_lands_and_disarms(quad: InWorld) -> None:
    there = LocalSetpoint(1, 1, 0.0, 1, WITHOUT_HEIGHT, (6.0, 0.0, 0.0), None, None, None)
    quad.tell(quad.station.encode(there))
    until(quad, lambda: is_at(quad, 6.0, 0.0, 3.0))
    assert ordered(quad, Command.DO_SET_MODE, 1.0, float(CopterMode.RTL)) == Result.ACCEPTED
    until(quad, lambda: quad.truth().down_m < -4.5)
    assert quad.truth().north_m == pytest.approx(6.0, abs=1.5)
    until(quad, lambda: quad.truth().north_m < 1.0)
    assert quad.truth().down_m == pytest.approx(-5.0, abs=0.6)
    assert {h.custom_mode for h in quad.sent(Heartbeat)[1:]} == {CopterMode.RTL}
    until(quad, lambda: is_down(quad))
    assert math.dist((quad.truth().north_m, quad.truth().east_m), (0.0, 0.0)) < 0.5


def test_return_on_the_ground_stays_there() -> None:
    world = ready()
    assert ordered(world, Command.DO_SET_MODE, 1.0, float(CopterMode.RTL)) == Result.ACCEPTED
    world.run(5.0)
    assert world.truth().down_m == 0.0


@pytest.mark.parametrize("alt_m", [7.0, NAN])
def test_reposition_with_a_height(quad: InWorld, alt_m: float) -> None:
    x, y = on_globe(quad, 2.0, -2.0)
    params = (-1.0, 1.0, 0.0, NAN)
    order = CommandInt(1, 1, RELATIVE, Command.DO_REPOSITION, params, x, y, alt_m)
    quad.tell(quad.station.encode(order))
    assert quad.sent(CommandAck)[-1].result == Result.ACCEPTED
    until(quad, lambda: is_at(quad, 2.0, -2.0, 3.0 if math.isnan(alt_m) else alt_m))


def test_an_absurd_height_is_denied(quad: InWorld) -> None:
    x, y = on_globe(quad, 2.0, -2.0)
    for alt_m in (math.inf, 1e30):
        params = (-1.0, 1.0, 0.0, NAN)
        order = CommandInt(1, 1, RELATIVE, Command.DO_REPOSITION, params, x, y, alt_m)
        quad.tell(quad.station.encode(order))
        assert quad.sent(CommandAck)[-1].result == Result.DENIED


@pytest.mark.parametrize(("mask", "height_m"), [(POSITION_ALONE, 5.0), (WITHOUT_HEIGHT, 3.0)])
def test_set_points_on_the_globe_and_near(quad: InWorld, mask: int, height_m: float) -> None:
    lat, lon = ned_to_wgs84(2.0, 1.0, quad.scenario.origin.origin())
    place = (lat, lon, 5.0)
    there = GlobalSetpoint(1, 1, 0.0, RELATIVE, mask, place, None, None, None)
    quad.tell(quad.station.encode(there))
    until(quad, lambda: is_at(quad, 2.0, 1.0, height_m))
    near = LocalSetpoint(1, 1, 0.0, 1, mask, (-1.0, 0.0, -5.0), None, None, None)
    quad.tell(quad.station.encode(near))
    until(quad, lambda: is_at(quad, -1.0, 0.0, height_m))


def test_silence_of_the_station_lands_it(quad: InWorld) -> None:
    for _ in range(1500):
        quad._frame()
    assert is_down(quad)
    assert "GCS Failsafe: Land" in [t.text for t in quad.sent(StatusText)]
    assert CopterMode.LAND in {h.custom_mode for h in quad.sent(Heartbeat)}


def goes_up(world: InWorld, height_m: float) -> None:
    take_off = (Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, height_m)
    assert ordered(world, *take_off) == Result.ACCEPTED


def highest(world: InWorld, seconds: float, velocity: tuple[float, float, float]) -> float:
    """How high it gets while it is sent a velocity, if that does not end the climb."""
    top_m = 0.0
    for _ in range(round(seconds / 0.1)):
        world.run(0.1, {1: velocity})
        top_m = max(top_m, -world.truth().down_m)
    return top_m


def test_a_velocity_waits_until_the_take_off_is_done() -> None:
    world = ready()
    goes_up(world, 3.0)
    world.run(0.5, {1: (1.0, 0.0, 0.0)})
    world.run(1.5, {1: (1.0, 0.0, 0.0)})
    assert abs(world.truth().north_mps) < 0.3
    assert highest(world, 6.0, (1.0, 0.0, 0.0)) > 2.7
    assert world.truth().north_mps == pytest.approx(1.0, abs=0.2)
    assert -world.truth().down_m == pytest.approx(3.0, abs=0.5)


def test_a_velocity_that_came_once_is_forgotten_when_the_climb_ends() -> None:
    world = ready()
    goes_up(world, 12.0)  # takes longer than a velocity lasts
    world.run(0.5, {1: (1.0, 0.0, 0.0)})
    world.run(12.0)
    assert is_at(world, 0.0, 0.0, 12.0)
    texts = [t.text for t in world.sent(StatusText)]
    assert "target not received last 3secs, stopping" not in texts


def test_a_point_waits_until_the_take_off_is_done() -> None:
    world = ready()
    goes_up(world, 3.0)
    there = LocalSetpoint(1, 1, 0.0, 1, POSITION_ALONE, (2.0, 0.0, -1.0), None, None, None)
    world.tell(world.station.encode(there))
    assert highest(world, 5.0, (0.0, 0.0, 0.0)) > 2.5
    world.tell(world.station.encode(there))
    until(world, lambda: is_at(world, 2.0, 0.0, 1.0))


@pytest.mark.parametrize(("frame", "height_m"), [(1, 1.0), (7, 4.0), (8, 4.0), (9, 4.0)])
def test_only_local_ned_counts_heights_from_the_origin(
    quad: InWorld, frame: int, height_m: float
) -> None:
    up = LocalSetpoint(1, 1, 0.0, frame, POSITION_ALONE, (0.0, 0.0, -1.0), None, None, None)
    quad.tell(quad.station.encode(up))
    until(quad, lambda: is_at(quad, 0.0, 0.0, height_m), 15.0)
    quad.run(3.0)
    assert is_at(quad, 0.0, 0.0, height_m)


def test_in_the_air_there_is_no_second_take_off(quad: InWorld) -> None:
    assert ordered(quad, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 6.0) == Result.FAILED
    quad.run(3.0)
    assert is_at(quad, 0.0, 0.0, 3.0)


WITHOUT_TAKE_OFF = (RELATIVE, Command.NAV_WAYPOINT, (0, 0), 3.0)
SPEED_FIRST = (RELATIVE, Command.DO_CHANGE_SPEED, (0, 0), 0.0)
UP = (RELATIVE, Command.NAV_TAKEOFF, (0, 0), 2.0)


def test_auto_on_the_ground_needs_a_take_off() -> None:
    world = ready()
    assert upload(world, WITHOUT_TAKE_OFF) == MissionResult.ACCEPTED
    for command, *params in ((Command.DO_SET_MODE, 1.0, 3.0), (Command.MISSION_START,)):
        assert ordered(world, command, *params) == Result.FAILED
        assert [t.text for t in world.sent(StatusText)] == ["Auto: Missing Takeoff Cmd"]
    world.run(2.0)
    assert world.sent(Heartbeat)[-1].custom_mode == CopterMode.GUIDED
    assert upload(world, SPEED_FIRST, UP) == MissionResult.ACCEPTED
    assert ordered(world, Command.MISSION_START) == Result.ACCEPTED


def test_arming_in_auto_needs_a_take_off() -> None:
    world = InWorld(scenario("quad_x"))
    world.run(1.5)
    upload(world, WITHOUT_TAKE_OFF)
    assert ordered(world, Command.DO_SET_MODE, 1.0, float(CopterMode.AUTO)) == Result.ACCEPTED
    assert ordered(world, Command.COMPONENT_ARM_DISARM, 1.0) == Result.FAILED
    assert [t.text for t in world.sent(StatusText)] == ["Arm: Missing Takeoff Cmd"]
    upload(world, UP)
    assert ordered(world, Command.COMPONENT_ARM_DISARM, 1.0) == Result.ACCEPTED


def test_in_the_air_a_mission_needs_no_take_off(quad: InWorld) -> None:
    upload(quad, (RELATIVE, Command.NAV_WAYPOINT, on_globe(quad, 2.0, 0.0), 4.0))
    assert ordered(quad, Command.MISSION_START) == Result.ACCEPTED
    until(quad, lambda: is_at(quad, 2.0, 0.0, 4.0))


def test_a_mission_left_half_way_starts_again_after_disarming(quad: InWorld) -> None:
    upload(quad, UP, (RELATIVE, Command.NAV_WAYPOINT, on_globe(quad, 2.0, 0.0), 4.0))
    assert ordered(quad, Command.MISSION_START) == Result.ACCEPTED
    quad.run(0.5)
    assert ordered(quad, Command.NAV_LAND) == Result.ACCEPTED
    until(quad, lambda: is_down(quad))
    assert ordered(quad, Command.COMPONENT_ARM_DISARM, 1.0) == Result.ACCEPTED
    assert ordered(quad, Command.MISSION_START) == Result.ACCEPTED
    until(quad, lambda: is_at(quad, 2.0, 0.0, 4.0))


def test_the_throttle_that_is_told_is_that_of_the_rotors(quad: InWorld) -> None:
    """Hovering: m g over the maximum thrust, through the bent thrust curve."""
    quad.run(3.0)
    quad.tell(quad.station.request_message(1, MessageId.VFR_HUD))
    assert QUAD_X.flight is not None
    e, share = QUAD_X.flight.thrust_expo, QUAD_X.weight_n / (4 * QUAD_X.motors[0].stall_force_n)
    u = quad.sent(VfrHud)[-1].throttle
    assert (1.0 - e) * u + e * u * u == pytest.approx(share, abs=0.02)
    ordered(quad, Command.COMPONENT_ARM_DISARM, 0.0)
    quad.run(0.1)
    quad.tell(quad.station.request_message(1, MessageId.VFR_HUD))
    assert quad.sent(VfrHud)[-1].throttle == 0.0
