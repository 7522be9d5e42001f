"""The plane against closed forms: driving, coasting, colliding, pushing."""

import itertools
import math
from typing import Any

import pytest

from hil.airframe import GRAVITY_MPS2, OMNI_PLUS, mix, output_to_pwm
from hil.scenario import Scenario
from hil.world.plant import real_airframe
from hil.world.space import World

EXACT_PLANT = {"motor_gain_sigma": 0, "mass_sigma": 0, "rolling_sigma": 0, "contact_friction": 0.2}
DECELERATION = OMNI_PLUS.rolling_resistance * GRAVITY_MPS2
MASS = OMNI_PLUS.mass_kg


def scenario(*starts: tuple[float, float], **changes: Any) -> Scenario:
    """Rovers 1, 2, ... in a 40 m square with the plant as on the data sheet."""
    fleet = [
        {
            "name": f"rover_{i}",
            "sysid": i,
            "start": {"north_m": n, "east_m": e},
            "goal": {"north_m": 0.0, "east_m": 0.0},
        }
        for i, (n, e) in enumerate(starts, start=1)
    ]
    arena = {"north_min_m": -20, "north_max_m": 20, "east_min_m": -20, "east_max_m": 20}
    tree = {"name": "plane", "arena": arena, "fleet": fleet, "plant": EXACT_PLANT}
    return Scenario.model_validate(tree | changes)


def pwm(x: float, y: float, yaw: float = 0.0) -> list[int]:
    return [output_to_pwm(u) for u in mix(OMNI_PLUS, x, y, yaw)]


def run(world: World, seconds: float, outputs: dict[int, list[int]]) -> None:
    for _ in range(round(seconds * world.physics_hz)):
        world.step(outputs)


def launch(world: World, sysid: int, north_mps: float, east_mps: float) -> None:
    """Give a body a velocity, as no motor could."""
    world._vehicles[sysid].body.velocity = north_mps, east_mps


def kinetic_energy_j(world: World) -> float:
    return sum(
        0.5 * MASS * (v.north_mps**2 + v.east_mps**2) for v in world.truth().vehicles.values()
    )


@pytest.mark.parametrize("drive", [0.3, 0.5, 1.0, -0.7])
def test_terminal_speed(drive: float) -> None:
    """Two motors of 16 N and 1.6 m/s against 0.1 m g: v = 1.6 (|u| - R / 32)."""
    world = World(scenario((0, 0)), 0)
    run(world, 6.0, {1: pwm(drive, 0.0)})
    rolling_share = OMNI_PLUS.rolling_force_n / OMNI_PLUS.axis_stall_force_n("x")
    expected = 1.6 * (output_error_free(drive) - rolling_share)
    assert world.truth().vehicles[1].north_mps == pytest.approx(
        math.copysign(expected, drive), rel=1e-6
    )


def output_error_free(drive: float) -> float:
    """The drive after PWM has rounded it to whole microseconds."""
    return abs((output_to_pwm(drive) - 1500) / 400)


@pytest.mark.parametrize("speed_mps", [0.3, 1.0, 1.5])
def test_coasting_distance(speed_mps: float) -> None:
    """Without power a rover rolls v^2 / (2 c_rr g) and stays there."""
    world = World(scenario((0, 0)), 0)
    launch(world, 1, 0.0, speed_mps)
    run(world, 3.0, {})
    rest = world.truth().vehicles[1]
    step_m = speed_mps / world.physics_hz
    assert rest.east_m == pytest.approx(speed_mps**2 / (2 * DECELERATION), abs=step_m)
    assert (rest.east_mps, rest.north_mps) == (0.0, 0.0)


def test_a_drive_below_the_rolling_resistance_moves_nothing() -> None:
    world = World(scenario((0, 0)), 0)
    run(world, 5.0, {1: pwm(0.2, 0.0)})
    assert world.truth().vehicles[1].north_m == pytest.approx(0.0, abs=1e-9)


def test_body_axes_turn_with_the_rover() -> None:
    """At yaw 90 degrees forward is east and right is south."""
    tree = scenario((0, 0)).model_dump()
    tree["fleet"][0]["start_yaw_deg"] = 90.0
    world = World(Scenario.model_validate(tree), 0)
    run(world, 2.0, {1: pwm(0.5, 0.8)})
    v = world.truth().vehicles[1]
    assert v.east_mps > 0.2
    assert v.north_mps < -0.5


def test_locked_yaw_holds_and_free_yaw_turns() -> None:
    locked, free = World(scenario((0, 0)), 0), World(scenario((0, 0), yaw="free"), 0)
    for world in (locked, free):
        run(world, 1.0, {1: pwm(0.0, 0.0, 0.4)})
    assert locked.truth().vehicles[1].yaw_rad == 0.0
    assert free.truth().vehicles[1].yaw_rad > 0.5
    assert free.state(1).gyro_radps[2] > 0.5


def test_turning_coasts_down_by_the_yaw_resistance() -> None:
    """From w, a disc turns on by w^2 I / (2 M)."""
    world = World(scenario((0, 0), yaw="free"), 0)
    world._vehicles[1].body.angular_velocity = 1.0
    run(world, 3.0, {})
    turned = OMNI_PLUS.yaw_inertia_kgm2 / (2 * OMNI_PLUS.yaw_resistance_nm)
    assert world.truth().vehicles[1].yaw_rad == pytest.approx(turned, abs=1 / world.physics_hz)


@pytest.mark.parametrize("offset_m", [0.0, 0.2, 0.45])
def test_collision_keeps_momentum_and_makes_no_energy(offset_m: float) -> None:
    """One step is short: only the ground's share, at most m c_rr g dt a body, may be missing."""
    world = World(scenario((0.0, 0.0), (offset_m, 0.7)), 0)
    launch(world, 1, 0.0, 1.5)
    ground_ns = 2 * OMNI_PLUS.rolling_force_n / world.physics_hz
    before = kinetic_energy_j(world)
    for _ in range(200):
        momentum = momentum_ns(world)
        world.step({})
        after = kinetic_energy_j(world)
        assert after <= before + 1e-9
        assert math.dist(momentum_ns(world), momentum) <= ground_ns + 1e-9
        before = after


def momentum_ns(world: World) -> tuple[float, float]:
    bodies = world.truth().vehicles.values()
    return MASS * sum(v.north_mps for v in bodies), MASS * sum(v.east_mps for v in bodies)


def test_head_on_collision_is_plastic() -> None:
    world = World(scenario((0.0, 0.0), (0.0, 0.61)), 0)
    launch(world, 1, 0.0, 1.0)
    while not world.contacts():
        speed_before = world.truth().vehicles[1].east_mps
        world.step({})
    first, second = world.truth().vehicles.values()
    common = (speed_before - 2 * DECELERATION / world.physics_hz) / 2
    assert first.east_mps == pytest.approx(second.east_mps, abs=1e-3)
    assert first.east_mps == pytest.approx(common, abs=DECELERATION / world.physics_hz)
    assert world.contacts()[0].bodies == ("rover_1", "rover_2")
    assert world.contacts()[0].point_m == pytest.approx((0.0, 0.305), abs=0.01)
    assert world.contacts()[0].impulse_ns == pytest.approx(MASS * speed_before / 2, rel=0.05)


@pytest.mark.parametrize("drive", [0.7, 1.0])
def test_pushing_speed(drive: float) -> None:
    """One pusher, two rolling resistances: v = 1.6 (u - 2 R / F)."""
    world = World(scenario((0.0, 0.0), (0.0, 0.61)), 0)
    run(world, 8.0, {1: pwm(0.0, drive)})
    expected = 1.6 * (drive - 2 * OMNI_PLUS.rolling_force_n / OMNI_PLUS.axis_stall_force_n("y"))
    for v in world.truth().vehicles.values():
        assert v.east_mps == pytest.approx(expected, rel=1e-3)


def test_a_push_below_both_resistances_does_not_creep() -> None:
    world = World(scenario((0.0, 0.0), (0.0, 0.6)), 0)
    run(world, 1.0, {1: pwm(0.0, 0.4)})
    start = world.truth().vehicles[2].east_m
    run(world, 20.0, {1: pwm(0.0, 0.4)})
    assert world.truth().vehicles[2].east_m == pytest.approx(start, abs=1e-4)


def test_walls_hold_and_are_named() -> None:
    world = World(scenario((19.0, 0.0)), 0)
    touched = set()
    for _ in range(5 * world.physics_hz):
        world.step({1: pwm(1.0, 0.0)})
        touched |= {c.bodies for c in world.contacts()}
    assert touched == {("rover_1", "wall_north")}
    assert world.truth().vehicles[1].north_m == pytest.approx(20.0 - 0.3, abs=0.002)


def test_specific_force_is_the_mean_over_the_frame() -> None:
    world = World(scenario((0, 0)), 0)
    assert world.state(1).accel_body_mps2 == (0.0, 0.0, -GRAVITY_MPS2)
    before = world.state(1)
    run(world, 0.02, {1: pwm(1.0, 0.0)})
    after = world.state(1)
    mean = (after.velocity_mps[0] - before.velocity_mps[0]) / (after.time_s - before.time_s)
    assert mean > 2.0
    assert after.accel_body_mps2 == pytest.approx((mean, 0.0, -GRAVITY_MPS2))
    assert world.state(1) == after


def test_the_same_seed_is_the_same_world() -> None:
    plant = {"plant": {}}
    worlds = [World(scenario((0, 0), (0, 0.7), **plant), seed) for seed in (3, 3, 4)]
    for world in worlds:
        run(world, 2.0, {1: pwm(0.1, 0.9)})
    assert worlds[0].truth() == worlds[1].truth()
    assert worlds[0].truth() != worlds[2].truth()


def test_the_plant_differs_by_vehicle_and_stays_near_the_data_sheet() -> None:
    plant = scenario((0, 0), plant={}).plant
    draws = [real_airframe(OMNI_PLUS, plant, seed, sysid) for seed in range(20) for sysid in (1, 2)]
    assert all(a != b for a, b in itertools.combinations(draws, 2))
    for frame in draws:
        assert frame.mass_kg == pytest.approx(MASS, rel=3 * plant.mass_sigma + 1e-9)
        for motor in frame.motors:
            assert motor.stall_force_n == pytest.approx(16.0, rel=3 * plant.motor_gain_sigma + 1e-9)
