"""A whole vehicle on an ideal body: it drives, stops, and fails the way it is told to."""

import math

import pytest
from vehicle_harness import Harness

from hil.mavlink import Heartbeat, LocalPosition, LocalSetpoint, RoverMode, ServoOutputs, StatusText
from hil.scenario import Scenario

MOTOR, GPS, OFF, STUCK, OK = 101, 4, 1, 2, 0


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.guided()
    return harness


def test_it_follows_a_velocity_sideways_without_turning(rover: Harness) -> None:
    rover.run(4.0, (0.3, -0.4))
    assert rover.velocity_mps == pytest.approx([0.3, -0.4], abs=0.05)


def test_it_goes_to_a_position(rover: Harness) -> None:
    rover.tell(rover.station.position_setpoint(2, 0, 2.0, -1.0))
    rover.run(12.0)
    assert math.dist(rover.position_m, (2.0, -1.0)) < 0.1


@pytest.mark.parametrize("frame", [8, 9])
def test_a_body_frame_set_point_is_turned_with_the_heading(rescue: Scenario, frame: int) -> None:
    rover = Harness(rescue)
    rover.yaw_rad = math.pi / 2
    rover.guided()
    sideways = LocalSetpoint(2, 1, 0.0, frame, 3527, None, (0.0, 0.5, 0.0), None, None)
    rover.tell(rover.station.encode(sideways))
    rover.run(0.02)
    assert rover.pwm[0] == pytest.approx(1500, abs=20)
    assert rover.pwm[2] > 1700


def test_an_offset_counts_from_where_the_rover_is(rover: Harness) -> None:
    rover.position_m = [1.0, 1.0]
    rover.run(5.0)
    ahead = LocalSetpoint(2, 1, 0.0, 7, 3576, (1.0, -1.0, 0.0), None, None, None)
    rover.tell(rover.station.encode(ahead))
    rover.run(12.0)
    assert math.dist(rover.position_m, (2.0, 0.0)) < 0.15


def test_silence_of_set_points_stops_it_after_three_seconds(rover: Harness) -> None:
    rover.run(2.0, (0.5, 0.0))
    rover.run(2.8)
    assert rover.velocity_mps[0] > 0.4
    rover.run(2.0)
    assert rover.velocity_mps == pytest.approx([0.0, 0.0], abs=0.01)
    assert "target not received last 3secs, stopping" in [t.text for t in rover.values(StatusText)]


def test_silence_of_the_station_holds_it(rover: Harness) -> None:
    rover.run(1.0, (0.5, 0.0))
    rover.run(7.0, (0.5, 0.0), beats=False)
    assert rover.pwm == (0,) * 16
    assert rover.values(Heartbeat)[-1].custom_mode == RoverMode.HOLD
    for port in ("gcs", "injector"):
        assert "GCS Failsafe: Hold" in [t.text for t in rover.values(StatusText, port)]


def test_the_failsafe_can_be_switched_off(rover: Harness) -> None:
    rover.tell(rover.station.param_set(2, "FS_GCS_ENABLE", 0.0))
    rover.run(8.0, (0.5, 0.0), beats=False)
    assert rover.velocity_mps[0] > 0.4


def test_hold_sets_the_wheels_free(rover: Harness) -> None:
    rover.run(1.0, (0.5, 0.0))
    rover.tell(rover.station.set_mode(2, RoverMode.HOLD))
    rover.run(0.02)
    assert rover.pwm == (0,) * 16


def test_hold_between_two_steps_still_resets_the_integrators(rover: Harness) -> None:
    rover.inject(MOTOR, OFF, 0)
    rover.run(2.0, (0.5, 0.0))  # it can't move, so the integrator is at its limit
    rover.tell(rover.station.set_mode(2, RoverMode.HOLD))
    rover.tell(rover.station.set_mode(2, RoverMode.GUIDED))
    rover.inject(MOTOR, OK, 0)
    rover.run(0.02)
    assert rover.pwm[0] == pytest.approx(1500, abs=3)


def test_a_broken_motor_is_silent(rover: Harness) -> None:
    rover.inject(MOTOR, OFF, 3)
    rover.inject(MOTOR, OFF, 4)
    rover.tell(rover.station.gcs_heartbeat())
    rover.run(3.0, (0.0, 0.5))
    assert rover.pwm[2:4] == (0, 0)
    assert rover.velocity_mps == pytest.approx([0.0, 0.0], abs=0.01)
    reported = rover.values(ServoOutputs)[-1].pwm_us
    assert reported[2] > 1600
    assert reported[3] > 1600


def test_repairing_the_motors_brings_the_motion_back(rover: Harness) -> None:
    rover.inject(MOTOR, OFF, 0)
    rover.run(1.0, (0.0, 0.5))
    assert rover.pwm == (0,) * 16
    rover.inject(MOTOR, OK, 0)
    rover.run(3.0, (0.0, 0.5))
    assert rover.velocity_mps[1] == pytest.approx(0.5, abs=0.05)


def test_a_stuck_gps_reports_rest_while_the_rover_moves(rover: Harness) -> None:
    rover.tell(rover.injector.param_set(2, "SIM_GPS1_STUCK", 2.0), "injector")
    rover.inject(GPS, STUCK, 0)
    rover.tell(rover.station.gcs_heartbeat())
    rover.run(3.0, (0.5, 0.5))
    seen = rover.values(LocalPosition)[-1]
    assert rover.position_m[1] > 1.0
    assert seen.position_m[0] == pytest.approx(rover.position_m[0], abs=0.1)
    assert seen.position_m[1] == pytest.approx(0.0, abs=0.1)
    assert seen.velocity_mps[1] == pytest.approx(0.0, abs=0.15)


def test_the_integrator_keeps_a_runaway_within_bounds(rover: Harness) -> None:
    """Frozen feedback adds at most 0.1 of output, which is 0.16 m/s of speed."""
    rover.inject(GPS, STUCK, 0)
    rover.run(20.0, (0.5, 0.0))
    assert rover.velocity_mps[0] < 0.5 + 0.1 * 1.6 + 0.02


def test_an_old_state_changes_nothing(rover: Harness) -> None:
    rover.run(1.0, (0.5, 0.0))
    state = rover.state()
    pwm = rover.vehicle.step(state)
    rover.vehicle.outbox("gcs")
    assert rover.vehicle.step(state) == pwm
    assert rover.vehicle.outbox("gcs") == []


def test_free_yaw_turns_to_the_heading_asked_for(rescue: Scenario) -> None:
    free = Harness(rescue.model_copy(update={"yaw": "free"}))
    free.guided()
    free.tell(free.station.velocity_setpoint(2, 0, 0.0, 0.0, 1.0))
    free.run(0.04)
    left, right = free.pwm[0], free.pwm[1]
    assert left > 1650  # turning right: the left wheel forward,
    assert right < 1350  # the right one back, at the limit of 0.5


def test_locked_yaw_ignores_the_heading_asked_for(rover: Harness) -> None:
    rover.tell(rover.station.velocity_setpoint(2, 0, 0.0, 0.0, 1.0))
    rover.run(0.04)
    assert rover.pwm[0] == rover.pwm[1]
