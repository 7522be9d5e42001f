"""Every fault: its effect in truth and in telemetry, and that clearing it restores both."""

import itertools
import math
import statistics
from collections.abc import Iterable

import pytest
from vehicle_world import InWorld, Velocity, scenario

from hil.airframe import PWM_LOCKED_US
from hil.faults import GATE, Fault, Type, Unit, to_clearing, to_injection
from hil.mavlink import (
    Attitude,
    CommandAck,
    EscTelemetry,
    FixType,
    GpsRaw,
    LocalPosition,
    Message,
    MessageId,
    ParamValue,
    Result,
    ServoOutputs,
)

NORTH: Velocity = (0.5, 0.0, 0.0)
EAST: Velocity = (0.0, 0.5, 0.0)
REST: Velocity = (0.0, 0.0, 0.0)


@pytest.fixture
def rover() -> InWorld:
    """In GUIDED; GPS_RAW_INT comes with every fix."""
    world = InWorld(scenario("omni_plus", yaw="locked"))
    world.tell(world.station.set_message_interval(1, MessageId.GPS_RAW_INT, 10.0))
    world.guided()
    return world


def breaks(
    world: InWorld, unit: Unit, kind: Type, *size: float, instances: Iterable[int] = ()
) -> None:
    world.inject(to_injection(Fault(unit, kind, tuple(instances), size=size)))
    world.clear()


def mends(world: InWorld, unit: Unit) -> None:
    world.inject(to_clearing(unit))
    world.clear()


def drive(world: InWorld, velocity: Velocity, seconds: float = 4.0) -> tuple[float, float]:
    """True speed (north, east) at the end."""
    world.clear()
    world.run(seconds, {1: velocity})
    return world.truth().north_mps, world.truth().east_mps


def gap_m(world: InWorld) -> tuple[float, float]:
    """Reported less true position."""
    told, truth = world.reported().position_m, world.truth()
    return told[0] - truth.north_m, told[1] - truth.east_m


def assert_sound(world: InWorld) -> None:
    """It drives as told, and reports what is true."""
    assert drive(world, REST) == pytest.approx((0.0, 0.0), abs=0.05)
    assert drive(world, (0.3, 0.4, 0.0), 6.0) == pytest.approx((0.3, 0.4), abs=0.06)
    assert gap_m(world) == pytest.approx((0.0, 0.0), abs=0.08)
    assert world.reported().velocity_mps[:2] == pytest.approx((0.3, 0.4), abs=0.15)


def test_sound_to_begin_with(rover: InWorld) -> None:
    assert_sound(rover)


def test_motor_off_coasts_and_is_silent(rover: InWorld) -> None:
    breaks(rover, Unit.MOTOR, Type.OFF, instances=(3, 4))
    assert drive(rover, EAST) == (0.0, 0.0)
    assert rover.sent(ServoOutputs)[-1].pwm_us[2] > 1600
    assert gap_m(rover) == pytest.approx((0.0, 0.0), abs=0.08)
    mends(rover, Unit.MOTOR)
    assert_sound(rover)


def test_a_locked_wheel_resists_where_an_idle_one_rolls(rover: InWorld) -> None:
    """Both x wheels idle: thrown at 1 m/s it rolls v^2 / 2 c g; locked, grip adds to that."""
    rolled = []
    for kind in (Type.OFF, Type.LOCKED):
        breaks(rover, Unit.MOTOR, kind, instances=(1, 2))
        rover.run(0.1, {1: REST})
        assert rover.pwm[1][0] == (PWM_LOCKED_US if kind is Type.LOCKED else 0)
        start_m = rover.truth().north_m
        rover.simulation.world._vehicles[1].body.velocity = 1.0, 0.0
        rover.run(2.0, {1: REST})
        rolled.append(rover.truth().north_m - start_m)
        mends(rover, Unit.MOTOR)
    weight_n, grip_n = 8.0 * 9.80665, 2 * 13.7
    assert rolled[0] == pytest.approx(8.0 / (2 * 0.1 * weight_n), abs=0.02)
    assert rolled[1] == pytest.approx(8.0 / (2 * (0.1 * weight_n + grip_n)), abs=0.01)
    assert_sound(rover)


def test_a_locked_wheel_holds_against_its_neighbours(rover: InWorld) -> None:
    breaks(rover, Unit.MOTOR, Type.LOCKED, instances=(3,))
    north, east = drive(rover, (0.5, 0.5, 0.0))
    assert north == pytest.approx(0.5, abs=0.06)
    assert east == pytest.approx(0.0, abs=0.01)
    assert rover.sent(ServoOutputs)[-1].pwm_us[2] > 1600
    mends(rover, Unit.MOTOR)
    assert_sound(rover)


def test_partial_thrust_is_slower_and_looks_normal(rover: InWorld) -> None:
    """Half the output less rolling resistance: 1.6 (u / 2 - 7.8 / 32) with u at its limit."""
    breaks(rover, Unit.MOTOR, Type.PARTIAL, 0.5)
    north, _ = drive(rover, (1.0, 0.0, 0.0), 8.0)
    output = 1.0 / 1.6 + 0.245 + 0.1
    assert north == pytest.approx(1.6 * (output / 2 - 0.245), abs=0.03)
    assert rover.sent(ServoOutputs)[-1].pwm_us[0] == pytest.approx(1500 + 400 * output, abs=3)
    mends(rover, Unit.MOTOR)
    assert_sound(rover)


def test_reversed_motors_drive_the_other_way(rover: InWorld) -> None:
    breaks(rover, Unit.MOTOR, Type.REVERSED, instances=(1, 2))
    assert drive(rover, NORTH)[0] < -0.4
    assert rover.reported().velocity_mps[0] < -0.4
    mends(rover, Unit.MOTOR)
    assert_sound(rover)


def test_a_stuck_motor_keeps_its_output(rover: InWorld) -> None:
    before = drive(rover, NORTH)
    pwm = rover.pwm[1][:2]
    breaks(rover, Unit.MOTOR, Type.STUCK, instances=(1, 2))
    after = drive(rover, (-0.5, 0.0, 0.0))
    assert rover.pwm[1][:2] == pwm
    assert after == pytest.approx(before, abs=0.05)
    assert rover.sent(ServoOutputs)[-1].pwm_us[0] < 1400
    mends(rover, Unit.MOTOR)
    assert_sound(rover)


def test_an_intermittent_motor_has_gaps(rover: InWorld) -> None:
    breaks(rover, Unit.MOTOR, Type.INTERMITTENT, 1.0, 0.4)
    powered = []
    for _ in range(150):
        rover.run(0.02, {1: NORTH})
        powered.append(rover.pwm[1][0] != 0)
    assert sum(powered) == pytest.approx(0.6 * 150, abs=3)
    assert powered[:18] == [False] * 18
    assert min(p.pwm_us[0] for p in rover.sent(ServoOutputs)) > 1600
    mends(rover, Unit.MOTOR)
    assert_sound(rover)


def test_esc_telemetry_can_be_wrong_while_the_motor_runs(rover: InWorld) -> None:
    def rpm() -> int:
        rover.clear()
        rover.tell(rover.station.request_message(1, MessageId.ESC_TELEMETRY_1_TO_4))
        return rover.sent(EscTelemetry)[-1].escs[0].rpm

    north, _ = drive(rover, NORTH)
    sound = rpm()
    breaks(rover, Unit.ESC, Type.WRONG, 0.25)
    assert drive(rover, NORTH)[0] == pytest.approx(north, abs=0.05)
    assert rpm() == pytest.approx(0.25 * sound, rel=0.1)
    breaks(rover, Unit.ESC, Type.OFF)
    assert rpm() == 0
    mends(rover, Unit.ESC)
    assert drive(rover, NORTH)[0] == pytest.approx(north, abs=0.05)
    assert rpm() == pytest.approx(sound, rel=0.1)


def test_gps_off_is_no_fix(rover: InWorld) -> None:
    drive(rover, REST)
    breaks(rover, Unit.GPS, Type.OFF)
    rover.run(3.0, {1: REST})
    assert rover.sent(GpsRaw)[-1].fix_type == FixType.NO_FIX
    mends(rover, Unit.GPS)
    rover.run(2.0, {1: REST})
    assert rover.sent(GpsRaw)[-1].fix_type == FixType.RTK_FIXED
    rover.guided()
    assert_sound(rover)


def test_gps_stuck_on_an_axis(rover: InWorld) -> None:
    rover.inject(to_injection(Fault(Unit.GPS, Type.STUCK, axes=("east",))))
    assert drive(rover, (0.5, 0.5, 0.0))[1] > 0.4
    north, east = gap_m(rover)
    assert north == pytest.approx(0.0, abs=0.08)
    assert east == pytest.approx(-rover.truth().east_m, abs=0.08)
    mends(rover, Unit.GPS)
    assert_sound(rover)


def test_gps_repeats_to_the_digit(rover: InWorld) -> None:
    breaks(rover, Unit.GPS, Type.REPEAT)
    assert drive(rover, NORTH)[0] > 0.4
    fixes = {(f.lat_deg, f.lon_deg, f.speed_mps) for f in rover.sent(GpsRaw)}
    assert len(fixes) == 1
    assert gap_m(rover)[0] == pytest.approx(-rover.truth().north_m, abs=0.1)
    mends(rover, Unit.GPS)
    assert_sound(rover)


def test_gps_offset_jumps_and_velocity_does_not(rover: InWorld) -> None:
    drive(rover, REST)
    breaks(rover, Unit.GPS, Type.OFFSET, 3.0, -2.0, 0.0)
    drive(rover, REST, 6.0)
    assert gap_m(rover) == pytest.approx((3.0, -2.0), abs=0.1)
    assert math.dist((rover.truth().north_m, rover.truth().east_m), (0.0, 0.0)) < 0.5
    mends(rover, Unit.GPS)
    drive(rover, REST, 6.0)
    assert_sound(rover)


def test_gps_drift_moves_the_position_alone(rover: InWorld) -> None:
    breaks(rover, Unit.GPS, Type.DRIFT, 0.1, 0.0, 0.0)
    drive(rover, REST, 5.0)
    first, _ = gap_m(rover)
    drive(rover, REST, 10.0)
    second, _ = gap_m(rover)
    assert second - first == pytest.approx(1.0, abs=0.15)
    mends(rover, Unit.GPS)
    drive(rover, REST, 6.0)
    assert_sound(rover)


def test_a_consistent_glitch_moves_position_and_velocity(rover: InWorld) -> None:
    """The autopilot believes it, and drives the other way."""
    breaks(rover, Unit.GPS, Type.GLITCH, 0.0, 0.3, 0.0)
    _, east = drive(rover, NORTH, 10.0)
    assert gap_m(rover)[1] == pytest.approx(3.0, abs=0.2)
    assert rover.reported().velocity_mps[1] - east == pytest.approx(0.3, abs=0.1)
    mends(rover, Unit.GPS)
    drive(rover, REST, 6.0)
    assert_sound(rover)


def test_gps_noise(rover: InWorld) -> None:
    def spread_m() -> float:
        drive(rover, REST, 20.0)
        lats = [f.lat_deg for f in rover.sent(GpsRaw)]
        steps = [math.radians(b - a) * 6_378_137.0 for a, b in itertools.pairwise(lats)]
        return statistics.stdev(steps) / math.sqrt(2.0)

    assert spread_m() == pytest.approx(0.02, rel=0.25)
    breaks(rover, Unit.GPS, Type.NOISE, 0.5)
    assert spread_m() == pytest.approx(0.5, rel=0.25)
    mends(rover, Unit.GPS)
    assert spread_m() == pytest.approx(0.02, rel=0.25)
    assert_sound(rover)


def test_a_delayed_gps_is_behind(rover: InWorld) -> None:
    breaks(rover, Unit.GPS, Type.DELAY, 1.0)
    drive(rover, NORTH, 8.0)
    assert gap_m(rover)[0] == pytest.approx(-0.5, abs=0.1)
    mends(rover, Unit.GPS)
    assert_sound(rover)


def test_an_intermittent_gps_has_gaps(rover: InWorld) -> None:
    breaks(rover, Unit.GPS, Type.INTERMITTENT, 4.0, 0.5)
    drive(rover, REST, 8.0)
    fixed = [f.fix_type != FixType.NO_FIX for f in rover.sent(GpsRaw)]
    # of each 4 s without a fix for 2, telemetry knows after one
    assert fixed.count(False) == pytest.approx(20, abs=4)
    mends(rover, Unit.GPS)
    drive(rover, REST, 4.0)
    assert all(f.fix_type == FixType.RTK_FIXED for f in rover.sent(GpsRaw)[12:])
    rover.guided()
    assert_sound(rover)


def test_gyro_bias_and_noise() -> None:
    world = InWorld(scenario("omni_plus"))
    world.guided()

    def rates() -> list[float]:
        drive(world, REST, 6.0)
        return [a.yaw_rate_radps for a in world.sent(Attitude)]

    sound = rates()
    assert statistics.mean(sound) == pytest.approx(0.0, abs=0.01)
    breaks(world, Unit.GYRO, Type.BIAS, 0.0, 0.0, 0.2)
    drive(world, REST, 20.0)
    assert statistics.mean(rates()) == pytest.approx(0.2, abs=0.02)
    # heading control is led astray: the compass draws back what the bias adds
    assert world.truth().yaw_rad == pytest.approx(-0.4, abs=0.1)
    breaks(world, Unit.GYRO, Type.NOISE, 0.1)
    assert statistics.stdev(rates()) == pytest.approx(0.1, rel=0.4)
    mends(world, Unit.GYRO)
    drive(world, REST, 30.0)
    assert statistics.mean(rates()) == pytest.approx(0.0, abs=0.01)
    assert world.truth().yaw_rad == pytest.approx(0.0, abs=0.05)


def test_accelerometer_bias_and_noise(rover: InWorld) -> None:
    def forward() -> list[float]:
        samples = []
        for _ in range(100):
            rover.run(0.02, {1: REST})
            sample = rover.vehicles[1]._senses.sample
            assert sample is not None
            samples.append(sample.accel_mps2[0])
        return samples

    rover.run(4.0, {1: REST})
    truth = rover.truth()
    assert statistics.stdev(forward()) < 0.2
    breaks(rover, Unit.ACCEL, Type.BIAS, 1.0, 0.0, 0.0)
    assert statistics.mean(forward()) == pytest.approx(1.0, abs=0.1)
    breaks(rover, Unit.ACCEL, Type.NOISE, 2.0)
    assert statistics.stdev(forward()) == pytest.approx(2.0, rel=0.3)
    mends(rover, Unit.ACCEL)
    assert statistics.mean(forward()) == pytest.approx(0.0, abs=0.1)
    assert rover.truth().north_m == pytest.approx(truth.north_m, abs=0.05)


def test_several_faults_at_once_and_their_clearing(rover: InWorld) -> None:
    breaks(rover, Unit.MOTOR, Type.OFF, instances=(3, 4))
    breaks(rover, Unit.MOTOR, Type.REVERSED, instances=(1, 2))
    breaks(rover, Unit.GPS, Type.OFFSET, 0.0, 5.0, 0.0)
    north, east = drive(rover, (0.5, 0.5, 0.0), 6.0)
    assert north < -0.4
    assert east == 0.0
    assert gap_m(rover)[1] == pytest.approx(5.0, abs=0.15)
    rover.inject(to_clearing(Unit.MOTOR, (1, 2)))
    assert drive(rover, (0.5, 0.5, 0.0)) == pytest.approx((0.5, 0.0), abs=0.06)
    mends(rover, Unit.MOTOR)
    mends(rover, Unit.GPS)
    drive(rover, REST, 6.0)
    assert_sound(rover)


def test_clearing_puts_the_sizes_back(rover: InWorld) -> None:
    breaks(rover, Unit.GPS, Type.OFFSET, 3.0, 0.0, 0.0)
    mends(rover, Unit.GPS)
    rover.tell(rover.injector.param_request_read(1, "SIM_GPS1_OFS_N"), 1, "injector")
    assert rover.sent(ParamValue, 1, "injector")[-1].value == 0.0
    rover.tell(rover.injector.param_set(1, GATE, 1.0), 1, "injector")
    rover.tell(rover.injector.inject_failure(1, Unit.GPS, 4, 0), 1, "injector")
    assert rover.sent(CommandAck, 1, "injector")[-1].result == Result.DENIED


def told(faults: Iterable[Fault], kind: type[Message]) -> list[Message]:
    """Messages of a vehicle at rest and without power, from before to after the faults."""
    world = InWorld(scenario("omni_plus"))
    world.tell(world.station.set_message_interval(1, MessageId.RAW_IMU, 10.0))
    for fault in faults:
        world.inject(to_injection(fault))
    world.run(4.0)
    for unit in Unit:
        world.inject(to_clearing(unit))
    world.clear()
    world.run(4.0)
    return world.sent(kind)


def test_the_draws_do_not_depend_on_faults() -> None:
    """Once all is cleared, the noise goes on as if nothing had been."""
    faults = [
        Fault(Unit.GPS, Type.OFF),
        Fault(Unit.GPS, Type.NOISE, size=(1.0,)),
        Fault(Unit.GPS, Type.REPEAT),
        Fault(Unit.GPS, Type.DELAY, size=(0.5,)),
        Fault(Unit.GYRO, Type.NOISE, size=(0.1,)),
        Fault(Unit.ACCEL, Type.NOISE, size=(0.1,)),
        Fault(Unit.MOTOR, Type.INTERMITTENT, size=(1.0, 0.5)),
    ]
    assert told(faults, GpsRaw) == told([], GpsRaw)
    assert [a.yaw_rate_radps for a in told(faults, Attitude)] == [
        a.yaw_rate_radps for a in told([], Attitude)
    ]
    assert len(told([], LocalPosition)) == 40
