"""Sensors and estimator: declared noise comes out, and a stuck GPS looks healthy."""

import itertools
import statistics
from dataclasses import replace

import pytest

from hil.damage import GpsDamage
from hil.physics_link import AT_REST_MPS2, PhysicsState
from hil.scenario import Sensors
from sim_vehicles.estimator import Estimator
from sim_vehicles.sensors import Gps, GpsFix, InertialSensors

NOISE = Sensors(gps_hz=50)
QUIET = NOISE.model_copy(
    update={"gps_position_sigma_m": 1e-9, "gps_velocity_sigma_mps": 1e-9, "gps_wander_sigma_m": 0.0}
)
REST = PhysicsState(
    0.0, (0.0, 0.0, 0.0), AT_REST_MPS2, (1.0, 2.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.3)
)
NORTH, EAST, ALL = 0b001, 0b010, 0b111
SAMPLES = 4000


def at(state: PhysicsState, tick: int) -> PhysicsState:
    return replace(state, time_s=tick * 0.02)


def driving(tick: int) -> PhysicsState:
    t = tick * 0.02
    return replace(
        REST,
        time_s=t,
        position_m=(1.0 + 0.5 * t, 2.0 - 0.2 * t, 0.0),
        velocity_mps=(0.5, -0.2, 0.0),
    )


def stuck(mask: int) -> GpsDamage:
    return GpsDamage(stuck_mask=mask)


def fixes(gps: Gps, count: int, stuck_mask: int = 0) -> list[GpsFix]:
    sampled = (gps.sample(at(REST, k), stuck(stuck_mask)) for k in range(count))
    return [fix for fix in sampled if fix is not None]


def test_the_rate_is_kept() -> None:
    assert len(fixes(Gps(Sensors(gps_hz=10), 0, 1), 500)) == 100


def test_the_declared_noise_comes_out() -> None:
    sampled = fixes(Gps(NOISE, 1, 2), SAMPLES)
    for axis in range(3):
        position = [f.position_m[axis] for f in sampled]
        steps = [b - a for a, b in itertools.pairwise(position)]
        velocity = [f.velocity_mps[axis] for f in sampled]
        # differences of neighbours see the white part alone: its variance twice
        assert statistics.stdev(steps) == pytest.approx(0.02 * 2**0.5, rel=0.1)
        assert statistics.stdev(velocity) == pytest.approx(0.05, rel=0.1)
        assert statistics.mean(position) == pytest.approx(REST.position_m[axis], abs=0.03)


def test_a_stuck_gps_at_rest_is_not_to_be_told_from_a_healthy_one() -> None:
    assert fixes(Gps(NOISE, 1, 2), SAMPLES, ALL) == fixes(Gps(NOISE, 1, 2), SAMPLES)


def test_noise_is_the_same_whether_stuck_or_not() -> None:
    healthy, broken = Gps(NOISE, 1, 2), Gps(NOISE, 1, 2)
    for k in range(500):
        a, b = healthy.sample(driving(k)), broken.sample(driving(k), stuck(ALL))
        assert a is not None
        assert b is not None
        now, frozen = driving(k), driving(0)
        for axis in range(3):
            moved = now.position_m[axis] - frozen.position_m[axis]
            assert a.position_m[axis] - b.position_m[axis] == pytest.approx(moved, abs=1e-12)


def test_a_stuck_axis_freezes_the_mean_it_had_at_onset() -> None:
    gps = Gps(QUIET, 0, 1)
    for k in range(50):
        gps.sample(driving(k))
    for k in range(50, 150):
        fix = gps.sample(driving(k), stuck(EAST))
        assert fix is not None
        assert fix.position_m[0] == pytest.approx(driving(k).position_m[0], abs=1e-6)
        assert fix.position_m[1] == pytest.approx(driving(50).position_m[1], abs=1e-6)
        assert fix.velocity_mps == pytest.approx((0.5, -0.2, 0.0), abs=1e-6)


def test_clearing_brings_the_truth_back_and_a_second_onset_freezes_anew() -> None:
    gps = Gps(QUIET, 0, 1)
    masks = [NORTH] * 10 + [0] * 10 + [NORTH] * 10
    seen = [gps.sample(driving(k), stuck(mask)) for k, mask in enumerate(masks)]
    for k, expected in ((9, 0), (19, 19), (29, 20)):
        fix = seen[k]
        assert fix is not None
        assert fix.position_m[0] == pytest.approx(driving(expected).position_m[0], abs=1e-6)


def test_an_axis_freed_while_another_stays_stuck_freezes_anew() -> None:
    gps = Gps(QUIET, 0, 1)
    masks = [ALL] * 10 + [EAST] * 10 + [ALL] * 10
    fix = [gps.sample(driving(k), stuck(mask)) for k, mask in enumerate(masks)][-1]
    assert fix is not None
    assert fix.position_m[0] == pytest.approx(driving(20).position_m[0], abs=1e-6)
    assert fix.position_m[1] == pytest.approx(driving(0).position_m[1], abs=1e-6)


def test_two_vehicles_have_noise_of_their_own() -> None:
    assert fixes(Gps(NOISE, 1, 2), 10) != fixes(Gps(NOISE, 1, 3), 10)
    assert fixes(Gps(NOISE, 1, 2), 10) == fixes(Gps(NOISE, 1, 2), 10)


def estimated(noise: Sensors, seconds: float) -> tuple[list[float], list[float], list[float]]:
    """Errors of position (m), velocity (m/s) and heading (rad) of a steady drive."""
    gps, inertial = Gps(noise, 3, 1), InertialSensors(noise, 3, 1)
    estimator = Estimator(noise)
    errors: tuple[list[float], list[float], list[float]] = ([], [], [])
    for k in range(round(seconds * 50)):
        state = driving(k)
        estimator.inertial(inertial.sample(state), 0.02)
        fix = gps.sample(state)
        if fix is not None:
            estimator.gps(fix)
        if k > 250:
            e = estimator.estimate()
            for axis in (0, 1):
                errors[0].append(e.position_m[axis] - state.position_m[axis])
                errors[1].append(e.velocity_mps[axis] - state.velocity_mps[axis])
            errors[2].append(e.yaw_rad - 0.3)
    return errors


def test_the_estimate_is_better_than_the_sensors() -> None:
    position, velocity, heading = estimated(Sensors(), 120.0)
    assert statistics.pstdev(position) < 0.017
    assert statistics.pstdev(velocity) < 0.042
    assert statistics.pstdev(heading) < 0.003
    assert statistics.mean(velocity) == pytest.approx(0.0, abs=0.005)
    assert statistics.mean(heading) == pytest.approx(0.0, abs=0.003)


def test_the_estimator_is_ready_after_a_second_of_fixes() -> None:
    gps, estimator = Gps(Sensors(gps_hz=10), 0, 1), Estimator(Sensors(gps_hz=10))
    ready_at = []
    for k in range(100):
        fix = gps.sample(at(REST, k))
        if fix is not None:
            estimator.gps(fix)
        if estimator.ready:
            ready_at.append(k)
    assert ready_at[0] == 45  # the tenth fix, at 0.9 s
