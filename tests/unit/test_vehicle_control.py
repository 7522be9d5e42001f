"""The controller in closed form: the station's twin copies these equations."""

import math
from dataclasses import replace

import pytest

from hil.airframe import OMNI_PLUS, mix, motor_forces
from sim_vehicles.control import Drive, Memory, drive_at, feed_forward, velocity_towards
from sim_vehicles.estimator import Estimate

DRIVE = Drive.of(OMNI_PLUS, yaw_locked=False)
LOCKED = Drive.of(OMNI_PLUS, yaw_locked=True)
STILL = Estimate((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0))
ROLLING = 0.10 * 8.0 * 9.80665 / 32.0  # c_rr m g over two motors' stall force
DT_S = 0.02


def moving(north_mps: float, east_mps: float) -> Estimate:
    return replace(STILL, velocity_mps=(north_mps, east_mps, 0.0))


def test_feed_forward_is_the_speed_line_plus_rolling_resistance() -> None:
    assert feed_forward(0.5, 1.6, ROLLING) == pytest.approx(0.5 / 1.6 + ROLLING)
    assert feed_forward(-0.5, 1.6, ROLLING) == pytest.approx(-0.5 / 1.6 - ROLLING)


def test_feed_forward_near_zero_does_not_fight_friction() -> None:
    assert feed_forward(0.019, 1.6, ROLLING) == pytest.approx(0.019 / 1.6)


def test_outputs_at_speed_are_feed_forward_alone() -> None:
    outputs, memory = drive_at(DRIVE, Memory(), moving(0.5, 0.2), (0.5, 0.2), DT_S)
    x, y = 0.5 / 1.6 + ROLLING, 0.2 / 1.6 + ROLLING
    assert outputs == pytest.approx((x, x, y, y))
    assert (memory.x, memory.y) == (0.0, 0.0)


def test_the_integrator_grows_with_the_error_and_stops_at_its_limit() -> None:
    _, memory = drive_at(DRIVE, Memory(), STILL, (0.4, -0.4), DT_S)
    assert (memory.x, memory.y) == pytest.approx((0.5 * 0.4 * DT_S, -0.5 * 0.4 * DT_S))
    for _ in range(1000):
        _, memory = drive_at(DRIVE, memory, STILL, (0.4, -0.4), DT_S)
    assert (memory.x, memory.y) == (0.1, -0.1)


def test_speed_is_limited_in_norm() -> None:
    fast, _ = drive_at(DRIVE, Memory(), moving(0.6, 0.8), (3.0, 4.0), DT_S)
    limit, _ = drive_at(DRIVE, Memory(), moving(0.6, 0.8), (0.6, 0.8), DT_S)
    assert fast == pytest.approx(limit)


def test_a_set_point_is_turned_into_the_body() -> None:
    east = replace(STILL, yaw_rad=math.pi / 2)
    outputs, _ = drive_at(DRIVE, Memory(yaw_rad=math.pi / 2), east, (0.0, 0.5), DT_S)
    north, _ = drive_at(DRIVE, Memory(), STILL, (0.5, 0.0), DT_S)
    assert outputs == pytest.approx(north)


def test_yaw_law_and_its_limit() -> None:
    turning = replace(STILL, yaw_rad=0.1, gyro_radps=(0.0, 0.0, 0.2))
    outputs, _ = drive_at(DRIVE, Memory(yaw_rad=0.2), turning, (0.0, 0.0), DT_S)
    u = 2.0 * 0.1 - 0.5 * 0.2
    assert outputs == pytest.approx([math.copysign(u, m.arm_m) for m in OMNI_PLUS.motors])
    outputs, _ = drive_at(DRIVE, Memory(yaw_rad=3.0), STILL, (0.0, 0.0), DT_S)
    assert max(map(abs, outputs)) == 0.5


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_turns_either_way(side: float) -> None:
    outputs, _ = drive_at(DRIVE, Memory(yaw_rad=0.1 * side), STILL, (0.0, 0.0), DT_S)
    arms = [m.arm_m for m in OMNI_PLUS.motors]
    assert all(u * arm * side > 0.0 for u, arm in zip(outputs, arms, strict=True))


def test_yaw_takes_the_short_way() -> None:
    outputs, _ = drive_at(
        DRIVE, Memory(yaw_rad=-3.1), replace(STILL, yaw_rad=3.1), (0.0, 0.0), DT_S
    )
    turn = outputs[0] * math.copysign(1.0, OMNI_PLUS.motors[0].arm_m)
    assert turn == pytest.approx(2.0 * (2 * math.pi - 6.2))


def test_a_locked_heading_is_not_steered() -> None:
    outputs, _ = drive_at(LOCKED, Memory(yaw_rad=1.0), STILL, (0.0, 0.0), DT_S)
    assert outputs == pytest.approx((0.0,) * 4)


def test_a_position_is_approached_in_proportion_and_within_the_limit() -> None:
    assert velocity_towards((0.5, -0.25), STILL, 1.0) == pytest.approx((0.4, -0.2))
    assert velocity_towards((30.0, 40.0), STILL, 1.0) == pytest.approx((0.6, 0.8))


@pytest.mark.parametrize("yaw", [-0.4, 0.4])
def test_a_yaw_command_turns_the_way_it_says(yaw: float) -> None:
    outputs = mix(OMNI_PLUS, 0.0, 0.0, yaw)
    _, _, torque_nm = motor_forces(OMNI_PLUS, outputs, (0.0, 0.0), 0.0)
    assert torque_nm * yaw > 0.0
