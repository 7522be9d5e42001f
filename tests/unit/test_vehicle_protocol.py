"""What no other file asks of the protocol: a hung loop, type masks, failsafes of what flies."""

import math

import pytest
from vehicle_world import InWorld, scenario

from hil.airframe import Airframe
from hil.faults import Fault, Type, Unit, to_clearing, to_injection
from hil.mavlink import (
    Command,
    CommandAck,
    CopterMode,
    Heartbeat,
    LocalSetpoint,
    ManualControl,
    MessageId,
    ParamValue,
    Result,
    StatusText,
    TypeMask,
)
from sim_vehicles.battery import BatteryState

NAN = float("nan")
ACCELERATIONS = 0b111000000
POSITIONS = TypeMask.X | TypeMask.Y | TypeMask.Z
VELOCITIES = TypeMask.VX | TypeMask.VY | TypeMask.VZ
NORTH_1, EAST_1 = (1.0, 0.0, 0.0), (0.0, 0.5, 0.0)


def ready(airframe: str) -> InWorld:
    world = InWorld(scenario(airframe))
    world.guided()
    return world


@pytest.fixture
def quad() -> InWorld:
    """At 4 m, in GUIDED."""
    world = ready("quad_x")
    world.tell(world.station.command_long(1, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 4.0))
    assert world.sent(CommandAck)[-1].result == Result.ACCEPTED
    world.run(9.0)
    return world


def follow(
    world: InWorld,
    seconds: float,
    position: tuple[float, float, float] | None = None,
    velocity: tuple[float, float, float] | None = None,
    yaw: float | None = None,
    yaw_rate: float | None = None,
) -> None:
    """A set-point with what is given, and the type mask that says so, each 0.5 s."""
    mask = ACCELERATIONS
    mask |= 0 if position else POSITIONS
    mask |= 0 if velocity else VELOCITIES
    mask |= TypeMask.YAW if yaw is None else 0
    mask |= TypeMask.YAW_RATE if yaw_rate is None else 0
    for _ in range(round(seconds / 0.5)):
        order = LocalSetpoint(1, 1, 0.0, 1, mask, position, velocity, yaw, yaw_rate)
        world.tell(world.station.encode(order))
        world.run(0.5)


def test_a_loop_that_hangs_is_silent() -> None:
    """Heartbeats come from the loop: without a step a vehicle answers, but shows no life."""
    world = ready("omni_plus")
    world.clear()
    for _ in range(20):
        world.tell(world.station.gcs_heartbeat())
        world.tell(world.station.param_request_read(1, "FS_TIMEOUT"))
    assert len(world.sent(ParamValue)) == 20
    assert world.sent(Heartbeat) == []


@pytest.mark.parametrize("airframe", ["omni_plus", "omni_x"])
def test_the_mask_decides_whether_the_heading_counts(airframe: str) -> None:
    world = ready(airframe)
    follow(world, 4.0, velocity=EAST_1)
    assert world.truth().yaw_rad == pytest.approx(0.0, abs=0.05)
    follow(world, 6.0, velocity=EAST_1, yaw=1.0)
    assert world.truth().yaw_rad == pytest.approx(1.0, abs=0.08)
    assert world.truth().east_mps == pytest.approx(0.5, abs=0.08)
    before_rad = world.truth().yaw_rad
    follow(world, 4.0, velocity=EAST_1, yaw_rate=-0.2)
    assert world.truth().yaw_rad - before_rad == pytest.approx(-0.8, abs=0.15)


def test_the_mask_for_what_flies(quad: InWorld) -> None:
    follow(quad, 8.0, position=(1.0, 2.0, -5.0), yaw=math.pi / 2)
    v = quad.truth()
    assert (v.north_m, v.east_m, v.down_m) == pytest.approx((1.0, 2.0, -5.0), abs=0.3)
    assert v.yaw_rad == pytest.approx(math.pi / 2, abs=0.1)
    follow(quad, 3.0, velocity=NORTH_1, yaw_rate=0.5)
    assert quad.states[1].gyro_radps[2] == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("airframe", ["omni_plus", "skid_steer"])
def test_a_mask_that_ignores_everything_moves_nothing(airframe: str) -> None:
    world = ready(airframe)
    follow(world, 2.0)
    assert abs(world.truth().north_m) < 0.05
    follow(world, 2.0, yaw=1.0)  # a heading alone is no set-point, as in ArduPilot
    assert abs(world.truth().yaw_rad) < 0.05


def set_parameter(world: InWorld, name: str, value: float) -> None:
    world.tell(world.station.param_set(1, name, value))
    assert world.sent(ParamValue)[-1].value == pytest.approx(value)


def texts(world: InWorld) -> list[str]:
    return [t.text for t in world.sent(StatusText)]


def is_down(world: InWorld) -> bool:
    return world.truth().down_m == 0.0 and not world.sent(Heartbeat)[-1].armed


def test_without_gps_it_lands_and_guided_is_refused(quad: InWorld) -> None:
    """Level, on its barometer, and softly; it drifts, because nothing tells it how fast it is."""
    quad.clear()
    quad.inject(to_injection(Fault(Unit.GPS, Type.OFF)))
    quad.run(4.5)
    assert quad.truth().down_m == pytest.approx(-4.0, abs=0.4)
    quad.run(2.5)
    assert "GPS Failsafe: Land" in texts(quad)
    assert quad.sent(Heartbeat)[-1].custom_mode == CopterMode.LAND
    quad.tell(quad.station.set_mode(1, CopterMode.GUIDED))
    assert quad.sent(CommandAck)[-1].result == Result.FAILED
    fastest_mps = 0.0
    for _ in range(200):
        if quad.truth().down_m < -0.1:
            fastest_mps = max(fastest_mps, quad.truth().down_mps)
        quad.run(0.1)
    assert fastest_mps < 1.5
    assert is_down(quad)
    assert math.hypot(quad.truth().north_m, quad.truth().east_m) < 5.0
    quad.inject(to_clearing(Unit.GPS))
    quad.run(2.0)
    quad.tell(quad.station.set_mode(1, CopterMode.GUIDED))
    assert quad.sent(CommandAck)[-1].result == Result.ACCEPTED


def drained(world: InWorld, airframe: Airframe) -> None:
    """Near its end: below every limit that is set."""
    pack = airframe.battery
    world.vehicles[1]._battery = BatteryState(pack.empty_v, 1.0, 0.98 * pack.capacity_mah, pack)


@pytest.mark.parametrize(
    ("action", "mode", "told"), [(1, CopterMode.RTL, "Rtl"), (2, CopterMode.LAND, "Land")]
)
def test_a_low_battery_brings_it_home_or_down(
    quad: InWorld, action: int, mode: CopterMode, told: str
) -> None:
    set_parameter(quad, "BATT_LOW_VOLT", 14.0)
    set_parameter(quad, "BATT_LOW_TIMER", 1)
    set_parameter(quad, "BATT_FS_LOW_ACT", action)
    drained(quad, quad.scenario.vehicle(1).frame)
    quad.clear()
    quad.run(3.0)
    assert f"Battery Failsafe: {told}" in texts(quad)
    assert quad.sent(Heartbeat)[-1].custom_mode == mode
    quad.run(40.0)
    assert is_down(quad)


def test_a_fence_turns_it_back(quad: InWorld) -> None:
    set_parameter(quad, "FENCE_TYPE", 2)
    set_parameter(quad, "FENCE_RADIUS", 5.0)
    set_parameter(quad, "FENCE_ACTION", 1)
    set_parameter(quad, "FENCE_ENABLE", 1)
    quad.clear()
    quad.run(6.0, {1: (1.5, 0.0, 0.0)})
    assert "Fence Breach: Rtl" in texts(quad)
    assert quad.sent(Heartbeat)[-1].custom_mode == CopterMode.RTL
    quad.run(40.0)
    assert is_down(quad)
    assert math.hypot(quad.truth().north_m, quad.truth().east_m) < 0.6


@pytest.mark.parametrize("airframe", ["omni_plus", "omni_x", "skid_steer", "quad_x"])
def test_every_airframe_tells_all_of_its_telemetry(airframe: str) -> None:
    """All that is listed can be asked for, once a vehicle is ready and its sticks have moved."""
    world = ready(airframe)
    set_parameter(world, "FENCE_ENABLE", 1)
    world.tell(world.station.encode(ManualControl(1, 0.0, 0.0, 0.0, 0.0)))
    world.run(1.0)
    for number in MessageId:
        world.clear()
        world.tell(world.station.request_message(1, number))
        ack, *_ = world.sent(CommandAck)
        others = [v for v in world.values[1, "gcs"] if not isinstance(v, CommandAck)]
        assert len(others) == (1 if ack.result == Result.ACCEPTED else 0), number
    for name in ("HEARTBEAT", "SYS_STATUS", "GPS_RAW_INT", "GLOBAL_POSITION_INT", "ATTITUDE"):
        world.tell(world.station.request_message(1, MessageId[name]))
        assert world.sent(CommandAck)[-1].result == Result.ACCEPTED
