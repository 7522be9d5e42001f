"""Autopilots of every airframe in the world: they go where they are told, as real ones do."""

import math

import pytest
from vehicle_world import InWorld, Velocity, scenario

from hil.airframe import QUAD_X, SKID_STEER
from hil.faults import Fault, Type, Unit, to_clearing, to_injection
from hil.mavlink import (
    TYPE_QUADROTOR,
    Attitude,
    Command,
    CommandAck,
    CopterMode,
    EscTelemetry,
    ExtendedSysState,
    Heartbeat,
    MessageId,
    Result,
    StatusText,
)

REST: Velocity = (0.0, 0.0, 0.0)
NAN = float("nan")


def ready(airframe: str, **changes: object) -> InWorld:
    world = InWorld(scenario(airframe, **changes))
    world.guided()
    return world


def ordered(world: InWorld, command: int, *params: float) -> int:
    world.clear()
    world.tell(world.station.command_long(1, command, *params))
    return world.sent(CommandAck)[-1].result


@pytest.fixture
def quad() -> InWorld:
    """At 5 m."""
    world = ready("quad_x")
    assert ordered(world, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 5.0) == Result.ACCEPTED
    world.run(12.0)
    return world


@pytest.mark.parametrize("velocity", [(0.5, 0.0, 0.0), (0.0, -0.7, 0.0), (-0.4, 0.5, 0.0)])
def test_omni_x_goes_sideways_without_turning(velocity: Velocity) -> None:
    world = ready("omni_x")
    world.run(5.0, {1: velocity})
    v = world.truth()
    assert (v.north_mps, v.east_mps) == pytest.approx(velocity[:2], abs=0.06)
    assert v.yaw_rad == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("bearing_deg", [0, 60, -100, 179])
def test_skid_steer_turns_towards_where_it_is_told_to_go(bearing_deg: float) -> None:
    world, bearing = ready("skid_steer"), math.radians(bearing_deg)
    world.run(10.0, {1: (0.8 * math.cos(bearing), 0.8 * math.sin(bearing), 0.0)})
    v = world.truth()
    assert math.atan2(v.east_mps, v.north_mps) == pytest.approx(bearing, abs=0.06)
    assert math.hypot(v.north_mps, v.east_mps) == pytest.approx(0.8, abs=0.08)
    assert v.yaw_rad == pytest.approx(bearing, abs=0.06)
    world.run(2.0, {1: REST})
    assert math.hypot(world.truth().north_mps, world.truth().east_mps) < 0.02


def test_skid_steer_reaches_a_point_and_keeps_to_its_speed() -> None:
    world = ready("skid_steer")
    world.tell(world.station.position_setpoint(1, 0, -2.0, 3.0))
    fastest = 0.0
    for _ in range(200):
        world.run(0.1)
        fastest = max(fastest, math.hypot(world.truth().north_mps, world.truth().east_mps))
    assert math.dist((world.truth().north_m, world.truth().east_m), (-2.0, 3.0)) < 0.15
    assert 0.5 < fastest < 1.1 * SKID_STEER.speed_limit_mps


def test_skid_steer_with_one_side_dead_goes_astray() -> None:
    world = ready("skid_steer")
    world.inject(to_injection(Fault(Unit.MOTOR, Type.OFF, (1,))))
    world.run(6.0, {1: (0.0, 1.0, 0.0)})
    north, east = world.truth().north_mps, world.truth().east_mps
    assert math.dist((north, east), (0.0, 1.0)) > 0.3
    assert world.reported().velocity_mps[:2] == pytest.approx((north, east), abs=0.15)
    world.inject(to_clearing(Unit.MOTOR))
    world.run(10.0, {1: (0.0, 1.0, 0.0)})
    assert (world.truth().north_mps, world.truth().east_mps) == pytest.approx((0.0, 1.0), abs=0.1)


def test_quad_stays_down_until_take_off() -> None:
    world = ready("quad_x")
    world.run(3.0, {1: (1.0, 0.0, -1.0)})
    assert world.truth().down_m == 0.0
    assert world.sent(Heartbeat)[-1].mav_type == TYPE_QUADROTOR
    assert world.sent(ExtendedSysState)[-1].landed_state == 1


def test_quad_takes_off_to_a_height_and_holds_it(quad: InWorld) -> None:
    for _ in range(10):
        quad.run(1.0)
        assert quad.truth().down_m == pytest.approx(-5.0, abs=0.15)
        assert abs(quad.truth().north_m) < 0.3
    assert quad.reported().position_m[2] == pytest.approx(-5.0, abs=0.15)
    assert quad.sent(ExtendedSysState)[-1].landed_state == 2


@pytest.mark.parametrize(
    "velocity", [(2.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, -1.0), (1.0, 1.0, -0.5)]
)
def test_quad_follows_a_velocity_in_all_axes(quad: InWorld, velocity: Velocity) -> None:
    quad.run(6.0, {1: velocity})
    v = quad.truth()
    assert (v.north_mps, v.east_mps, v.down_mps) == pytest.approx(velocity, abs=0.2)


@pytest.mark.parametrize(
    "fault",
    [
        Fault(Unit.GPS, Type.STUCK),
        Fault(Unit.GPS, Type.OFFSET, size=(0.0, 0.0, -4.0)),
        Fault(Unit.GPS, Type.DRIFT, size=(0.0, 0.0, 0.5)),
    ],
    ids=lambda fault: fault.type.value,
)
def test_height_is_the_barometers_and_no_gps_fools_it(quad: InWorld, fault: Fault) -> None:
    quad.inject(to_injection(fault))
    quad.run(4.0, {1: (0.0, 0.0, -0.5)})
    quad.run(3.0, {1: REST})
    assert quad.truth().down_m == pytest.approx(-7.0, abs=0.2)
    assert quad.reported().position_m[2] == pytest.approx(quad.truth().down_m, abs=0.1)


def test_quad_tilts_no_further_than_its_limit(quad: InWorld) -> None:
    assert QUAD_X.flight is not None
    steepest = 0.0
    for velocity in ((3.0, 0.0, 0.0), (-3.0, 0.0, 0.0)):
        for _ in range(100):
            quad.run(0.02, {1: velocity})
            roll, pitch, _ = quad.states[1].attitude_rad
            steepest = max(steepest, math.hypot(roll, pitch))
    assert 0.3 < steepest < QUAD_X.flight.tilt_limit_rad + math.radians(5.0)
    assert max(abs(a.pitch_rad) for a in quad.sent(Attitude)) == pytest.approx(steepest, abs=0.1)


def test_quad_goes_to_a_point(quad: InWorld) -> None:
    setpoint = quad.station._setpoint(1, 0, 3576, (4.0, -3.0, -8.0), None, None)
    quad.tell(setpoint)
    quad.run(20.0)
    v = quad.truth()
    assert math.dist((v.north_m, v.east_m, v.down_m), (4.0, -3.0, -8.0)) < 0.3


def test_quad_in_wind_stays_where_it_is() -> None:
    world = ready("quad_x", terrain={"wind": {"east_mps": 5.0}})
    ordered(world, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 5.0)
    world.run(20.0)
    assert abs(world.truth().east_m) < 0.5
    assert world.states[1].attitude_rad[0] < -0.02  # it leans into the wind


def test_quad_lands_and_disarms(quad: InWorld) -> None:
    assert ordered(quad, Command.NAV_LAND) == Result.ACCEPTED
    fastest = 0.0
    for _ in range(200):
        before_m = quad.truth().down_m
        quad.run(0.1)
        if before_m > -1.0:
            fastest = max(fastest, quad.truth().down_mps)
    assert quad.truth().down_m == 0.0
    assert fastest < 0.7
    assert not quad.sent(Heartbeat)[-1].armed
    assert quad.pwm[1][:4] == (0, 0, 0, 0)


def test_quad_modes_are_copters(quad: InWorld) -> None:
    def told() -> int:
        quad.clear()
        quad.run(2.0)
        return quad.sent(Heartbeat)[-1].custom_mode

    def asked(mode: int) -> int:
        return ordered(quad, Command.DO_SET_MODE, 1.0, float(mode))

    assert told() == CopterMode.GUIDED
    assert asked(CopterMode.LAND) == Result.ACCEPTED
    assert told() == CopterMode.LAND
    assert asked(CopterMode.LOITER) == Result.ACCEPTED
    assert told() == CopterMode.LOITER
    assert quad.truth().down_m < -1.0
    assert asked(CopterMode.STABILIZE) == Result.ACCEPTED
    assert told() == CopterMode.STABILIZE
    assert asked(CopterMode.GUIDED) == Result.ACCEPTED
    assert asked(7) == Result.UNSUPPORTED  # CIRCLE
    assert "Mode 7 is not implemented" in [t.text for t in quad.sent(StatusText)]


def test_take_off_and_landing_need_their_moment() -> None:
    rover, on_ground = ready("skid_steer"), ready("quad_x")
    assert ordered(rover, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 5.0) == Result.UNSUPPORTED
    assert ordered(on_ground, Command.NAV_LAND) == Result.FAILED
    assert ordered(on_ground, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, -5.0) == Result.DENIED
    on_ground.tell(on_ground.station.set_mode(1, CopterMode.LOITER))
    assert ordered(on_ground, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 5.0) == Result.FAILED


def test_no_mode_cuts_the_rotors_in_the_air_but_disarming_does(quad: InWorld) -> None:
    quad.tell(quad.station.set_mode(1, CopterMode.LOITER))
    quad.run(5.0)
    assert quad.truth().down_m == pytest.approx(-5.0, abs=0.2)
    ordered(quad, Command.COMPONENT_ARM_DISARM, 0.0, 21196.0)
    quad.run(3.0)
    assert quad.truth().down_m == 0.0


def test_a_quad_that_loses_a_motor_comes_down(quad: InWorld) -> None:
    quad.inject(to_injection(Fault(Unit.MOTOR, Type.OFF, (2,))))
    toppled = []
    for _ in range(300):
        quad.run(0.02)
        toppled.append(quad.simulation.world._vehicles[1].air.toppled)
    assert any(toppled)
    assert quad.truth().down_m == 0.0


def test_a_quad_with_a_weak_motor_still_flies(quad: InWorld) -> None:
    quad.inject(to_injection(Fault(Unit.MOTOR, Type.PARTIAL, (1,), size=(0.9,))))
    quad.run(8.0)
    assert quad.truth().down_m == pytest.approx(-5.0, abs=0.3)


def test_a_rotor_cannot_be_reversed() -> None:
    world = ready("quad_x")
    for name, value in (("SYS_FAILURE_EN", 1.0), ("SIM_ENGINE_MUL", -1.0)):
        world.tell(world.injector.param_set(1, name, value), 1, "injector")
    world.tell(world.injector.inject_failure(1, Unit.MOTOR, 4, 1), 1, "injector")
    assert world.sent(CommandAck, 1, "injector")[-1].result == Result.DENIED


def test_esc_telemetry_of_rotors_counts_from_throttle_zero() -> None:
    def rpms(world: InWorld) -> list[int]:
        world.clear()
        world.tell(world.station.request_message(1, MessageId.ESC_TELEMETRY_1_TO_4))
        return [esc.rpm for esc in world.sent(EscTelemetry)[-1].escs]

    world = InWorld(scenario("quad_x"))
    world.run(1.5)
    assert rpms(world) == [0, 0, 0, 0]
    world.guided()
    world.run(1.0)
    idle = rpms(world)
    assert ordered(world, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 5.0) == Result.ACCEPTED
    world.run(10.0)
    assert all(0 < low < 200 for low in idle)
    assert all(1_200 < rpm < 2_400 for rpm in rpms(world))
