"""Every airframe in the world against closed forms; wind, slope and patches."""

import math
from typing import Any

import pytest

from hil.airframe import (
    AIRFRAMES,
    GRAVITY_MPS2,
    OMNI_PLUS,
    OMNI_X,
    QUAD_X,
    SKID_STEER,
    Airframe,
    Flight,
    mix,
    mix_rotors,
    output_to_pwm,
    pwm_to_output,
    throttle_for,
)
from hil.errors import InputError
from hil.scenario import STATION_AIRFRAMES, Scenario, Slope, Wind, station_view
from hil.world.space import World
from hil.world.terrain import AIR_DENSITY_KGPM3, slope_force_n, wind_force_n

EXACT = {"motor_gain_sigma": 0, "mass_sigma": 0, "rolling_sigma": 0}
FULL, IDLE, ZERO = 1900, 1100, 1500
STEP_S = 1 / 200
FLIGHT = QUAD_X.flight or pytest.fail("a quadcopter flies")


def world(*vehicles: tuple[str, float, float], **changes: Any) -> World:
    """Vehicles 1, 2, ... with free heading; airframe, north, east (m)."""
    fleet = [
        {
            "name": f"v{i}",
            "sysid": i,
            "airframe": name,
            "start": {"north_m": n, "east_m": e},
            "goal": {"north_m": 0.0, "east_m": 0.0},
        }
        for i, (name, n, e) in enumerate(vehicles, start=1)
    ]
    arena = {"north_min_m": -50, "north_max_m": 50, "east_min_m": -50, "east_max_m": 50}
    tree = {"name": "plane", "arena": arena, "fleet": fleet, "plant": EXACT, "yaw": "free"}
    return World(Scenario.model_validate(tree | changes), 0)


def run(w: World, seconds: float, outputs: dict[int, list[int]]) -> None:
    for _ in range(round(seconds / STEP_S)):
        w.step(outputs)


def launch(w: World, north_mps: float, east_mps: float, sysid: int = 1) -> None:
    w._vehicles[sysid].body.velocity = north_mps, east_mps


def energy_j(w: World, frames: dict[int, Airframe]) -> float:
    """Kinetic and potential, of motion in the plane, of turning, and of height."""
    total = 0.0
    for sysid, v in w.truth().vehicles.items():
        frame, rate = frames[sysid], w._vehicles[sysid].body.angular_velocity
        speed = math.hypot(v.north_mps, v.east_mps, v.down_mps)
        total += 0.5 * frame.mass_kg * speed**2 + 0.5 * frame.yaw_inertia_kgm2 * rate**2
        total -= frame.weight_n * v.down_m
    return total


def pwm(outputs: tuple[float, ...]) -> list[int]:
    return [output_to_pwm(u) for u in outputs]


# omni X


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("drive", [0.5, -0.9])
def test_omni_x_terminal_speed(axis: str, drive: float) -> None:
    """Four wheels at 45 degrees: v = 1.6 (|u| - R / 32), along either axis."""
    w = world(("omni_x", 0, 0))
    run(w, 6.0, {1: pwm(mix(OMNI_X, *((drive, 0.0) if axis == "x" else (0.0, drive)), 0.0))})
    v = w.truth().vehicles[1]
    along, across = (v.north_mps, v.east_mps) if axis == "x" else (v.east_mps, v.north_mps)
    expected = 1.6 * (abs(drive) - OMNI_X.rolling_force_n / OMNI_X.axis_stall_force_n(axis))
    assert along == pytest.approx(math.copysign(expected, drive), abs=0.005)
    assert across == pytest.approx(0.0, abs=1e-9)


def test_omni_x_turns_on_the_spot() -> None:
    """Terminal turn rate: (u - M / (4 F r)) v0 / r, either way."""
    for side in (1.0, -1.0):
        w = world(("omni_x", 0, 0))
        run(w, 5.0, {1: pwm(mix(OMNI_X, 0.0, 0.0, 0.5 * side))})
        expected = (0.5 - OMNI_X.yaw_resistance_nm / (64.0 * 0.2)) * 1.6 / 0.2
        assert w.state(1).gyro_radps[2] == pytest.approx(expected * side, rel=1e-3)


# skid-steer


def test_skid_steer_terminal_speed_and_turn_rate() -> None:
    stall_n, arm_m, free_mps = 90.0, 0.188, 2.4
    ahead, turning = world(("skid_steer", 0, 0)), world(("skid_steer", 0, 0))
    run(ahead, 6.0, {1: [FULL, FULL]})
    run(turning, 6.0, {1: [FULL, IDLE]})
    speed = free_mps * (1.0 - SKID_STEER.rolling_force_n / stall_n)
    rate = free_mps / arm_m * (1.0 - SKID_STEER.yaw_resistance_nm / (stall_n * arm_m))
    assert ahead.truth().vehicles[1].north_mps == pytest.approx(speed, rel=1e-3)
    assert turning.state(1).gyro_radps[2] == pytest.approx(rate, rel=1e-3)
    assert turning.truth().vehicles[1].north_m == pytest.approx(0.0, abs=1e-3)


def test_skid_steer_rolls_far_and_slides_short() -> None:
    """v^2 / 2 c g ahead, v^2 / 2 (c + mu) g sideways."""
    for north, east, c in ((1.5, 0.0, 0.06), (0.0, 1.5, 0.06 + 0.7)):
        w = world(("skid_steer", 0, 0))
        launch(w, north, east)
        run(w, 4.0, {})
        v = w.truth().vehicles[1]
        way = 1.5**2 / (2 * c * GRAVITY_MPS2)
        assert math.hypot(v.north_m, v.east_m) == pytest.approx(way, abs=1.5 * STEP_S)


def test_skid_steer_cannot_be_pushed_sideways_by_one_rover_but_by_seven() -> None:
    """It grips with 117 N and 10 N of rolling; a rover gives at most 32 less its own 8."""
    drive = pwm(mix(OMNI_PLUS, 0.0, 1.0, 0.0))
    for count, moves in ((1, False), (7, True)):
        rovers = [("omni_plus", 0.0, -0.64 - 0.61 * i) for i in range(count)]
        w = world(("skid_steer", 0, 0), *rovers, yaw="free")
        for body in w._vehicles.values():
            body.body.moment = math.inf  # a straight row stays straight
        run(w, 4.0, dict.fromkeys(range(2, count + 2), drive))
        east_m = w.truth().vehicles[1].east_m
        assert (east_m > 0.5) if moves else (abs(east_m) < 0.01)


def test_skid_steer_does_not_creep_on_its_grip() -> None:
    w = world(("skid_steer", 0, 0), ("omni_plus", 0, -0.63))
    drive = {2: pwm(mix(OMNI_PLUS, 0.0, 1.0, 0.0))}
    run(w, 1.0, drive)
    start_m = w.truth().vehicles[1].east_m
    run(w, 10.0, drive)
    assert w.truth().vehicles[1].east_m == pytest.approx(start_m, abs=1e-3)


# quadcopter


def hover_pwm(share: float = 1.0) -> list[int]:
    """All four rotors giving that share of the weight."""
    u = throttle_for(QUAD_X, share * QUAD_X.weight_n / 44.0)
    return [output_to_pwm(2.0 * u - 1.0)] * 4


def thrust_n(pwm_us: int) -> float:
    output = pwm_to_output(pwm_us)
    assert output is not None
    u = (output + 1.0) / 2.0
    return 44.0 * ((1.0 - FLIGHT.thrust_expo) * u + FLIGHT.thrust_expo * u * u)


def test_hover_thrust_is_the_weight() -> None:
    assert thrust_n(hover_pwm()[0]) == pytest.approx(QUAD_X.weight_n, rel=5e-3)


def test_it_stays_down_below_hover_thrust_and_rises_above() -> None:
    below, above = world(("quad_x", 0, 0)), world(("quad_x", 0, 0))
    run(below, 2.0, {1: hover_pwm(0.97)})
    run(above, 2.0, {1: hover_pwm(1.03)})
    assert below.truth().vehicles[1].down_m == 0.0
    assert above.truth().vehicles[1].down_m < -0.3


@pytest.mark.parametrize("share", [1.2, 1.6])
def test_terminal_climb_rate(share: float) -> None:
    """Drag takes what thrust has beyond weight: rho / 2 CdA v^2 = T - m g."""
    w = world(("quad_x", 0, 0))
    climb = hover_pwm(share)
    run(w, 40.0, {1: climb})
    surplus_n = thrust_n(climb[0]) - QUAD_X.weight_n
    expected = math.sqrt(2 * surplus_n / (AIR_DENSITY_KGPM3 * QUAD_X.drag_area_m2))
    assert -w.truth().vehicles[1].down_mps == pytest.approx(expected, rel=1e-3)


def test_first_climb_is_uniform_acceleration() -> None:
    w = world(("quad_x", 0, 0))
    run(w, 0.2, {1: [FULL] * 4})
    acceleration = 44.0 / QUAD_X.mass_kg - GRAVITY_MPS2
    assert -w.truth().vehicles[1].down_mps == pytest.approx(0.2 * acceleration, rel=0.02)


def test_free_fall_ends_on_the_ground() -> None:
    w = world(("quad_x", 0, 0))
    run(w, 1.0, {1: [FULL] * 4})
    top = w.truth().vehicles[1]
    before = energy_j(w, {1: QUAD_X})
    for _ in range(2000):
        w.step({})
        after = energy_j(w, {1: QUAD_X})
        # semi-implicit steps are off by m g^2 dt^2 / 2 at most, and not in one direction
        assert after <= before + 0.5 * QUAD_X.mass_kg * (GRAVITY_MPS2 * STEP_S) ** 2
        before = after
    rest = w.truth().vehicles[1]
    assert top.down_m < -4.0
    assert (rest.down_m, rest.down_mps) == (0.0, 0.0)


def test_tilt_accelerates_sideways() -> None:
    """At a tilt of a, with lift equal to weight: g tan a."""
    w = world(("quad_x", 0, 0))
    run(w, 0.5, {1: [FULL] * 4})
    tilt = math.radians(10.0)
    w._vehicles[1].air = w._vehicles[1].air.__class__(down_m=-5.0, tilt_rad=(tilt, 0.0))
    launch(w, 0.0, 0.0)
    run(w, 0.1, {1: hover_pwm(1.0 / math.cos(tilt))})
    assert w.truth().vehicles[1].east_mps == pytest.approx(
        0.1 * GRAVITY_MPS2 * math.tan(tilt), rel=0.02
    )


@pytest.mark.parametrize(
    ("turn", "sign"),
    [((0.05, 0, 0), (1, 0, 0)), ((0, 0.05, 0), (0, 1, 0)), ((0, 0, 0.05), (0, 0, 1))],
)
def test_moments_turn_it_the_way_they_say(turn: tuple[float, ...], sign: tuple[int, ...]) -> None:
    w = world(("quad_x", 0, 0))
    run(w, 0.5, {1: [FULL] * 4})
    run(w, 0.1, {1: pwm(mix_rotors(QUAD_X, 0.5, *turn))})
    for rate, expected in zip(w.state(1).gyro_radps, sign, strict=True):
        assert (rate > 0.05) if expected else (rate == pytest.approx(0.0, abs=0.02))


@pytest.mark.parametrize("motor", range(4))
def test_without_a_motor_it_falls_over_and_comes_down(motor: int) -> None:
    w = world(("quad_x", 0, 0))
    run(w, 1.0, {1: [FULL] * 4})
    dead = [0 if i == motor else p for i, p in enumerate(hover_pwm())]
    toppled = []
    for _ in range(100):
        w.step({1: dead})
        toppled.append(w._vehicles[1].air.toppled)
    assert any(toppled)
    run(w, 6.0, {1: dead})
    assert w.truth().vehicles[1].down_m == 0.0
    assert math.hypot(w.truth().vehicles[1].north_mps, w.truth().vehicles[1].east_mps) < 0.01


@pytest.mark.parametrize("motor", range(4))
def test_losing_a_motor_costs_its_share_of_lift_and_of_balance(motor: int) -> None:
    """At hover: g/4 down, and moments that the other three no longer balance; it starts to spin."""
    w, seconds = world(("quad_x", 0, 0)), 0.02
    w._vehicles[1].air = w._vehicles[1].air.__class__(down_m=-5.0)
    run(w, seconds, {1: [0 if i == motor else p for i, p in enumerate(hover_pwm())]})
    lost, share_n = QUAD_X.motors[motor], QUAD_X.weight_n / 4.0
    tilting = share_n / FLIGHT.tilt_inertia_kgm2 * seconds
    spinning = share_n * FLIGHT.drag_torque_m / QUAD_X.yaw_inertia_kgm2 * seconds
    x, y = lost.position_m
    expected = (y * tilting, -x * tilting, -lost.spin * spinning)
    assert w.state(1).gyro_radps == pytest.approx(expected, rel=0.05)
    assert w.truth().vehicles[1].down_mps == pytest.approx(9.81 / 4.0 * seconds, rel=0.03)


def test_it_passes_over_a_rover_and_bumps_into_another_quad() -> None:
    w = world(("quad_x", 0.0, 0.0), ("omni_plus", 0.0, 1.5), ("quad_x", 0.0, 3.0))
    run(w, 0.6, {1: [FULL] * 4, 3: [FULL] * 4})
    hover = {1: hover_pwm(), 3: hover_pwm()}
    for sysid in (1, 3):
        air = w._vehicles[sysid].air
        w._vehicles[sysid].air = air.__class__(down_m=-2.0)
    launch(w, 0.0, 2.0)
    touched = set()
    for _ in range(300):
        w.step(hover)
        touched |= {c.bodies for c in w.contacts()}
    assert touched == {("v1", "v3")}
    assert w.truth().vehicles[2].east_m == 1.5


def test_on_the_ground_a_rover_bumps_into_it() -> None:
    w = world(("quad_x", 0.0, 0.0), ("omni_plus", 0.0, 1.0))
    launch(w, 0.0, -1.5, sysid=2)
    touched = set()
    for _ in range(200):
        w.step({})
        touched |= {c.bodies for c in w.contacts()}
    assert touched == {("v1", "v2")}


# all of them


@pytest.mark.parametrize("name", AIRFRAMES)
def test_contact_keeps_momentum_and_makes_no_energy(name: str) -> None:
    """Only the ground's share of a step may be missing from momentum."""
    frame = AIRFRAMES[name]
    w = world((name, 0.1, 0.0), (name, 0.0, 2.2 * frame.radius_m))
    launch(w, 0.0, 1.5)
    frames = {1: frame, 2: frame}
    most_ns = 2 * frame.resistance_n("y") * STEP_S * 1.01
    before = energy_j(w, frames)
    touched = False
    for _ in range(200):
        old = w.truth().vehicles.values()
        w.step({})
        new = w.truth().vehicles.values()
        change = [
            frame.mass_kg
            * sum(getattr(b, k) - getattr(a, k) for a, b in zip(old, new, strict=True))
            for k in ("north_mps", "east_mps")
        ]
        assert math.hypot(*change) <= most_ns
        after = energy_j(w, frames)
        assert after <= before + 1e-9
        before, touched = after, touched or bool(w.contacts())
    assert touched


def test_omni_plus_terminal_turn_rate() -> None:
    """As omni X: (u - M / (4 F r)) v0 / r."""
    w = world(("omni_plus", 0, 0))
    run(w, 5.0, {1: pwm(mix(OMNI_PLUS, 0.0, 0.0, 0.5))})
    stall_n = sum(m.stall_force_n for m in OMNI_PLUS.motors)
    arm_m = math.hypot(*OMNI_PLUS.motors[0].position_m)
    free_mps = OMNI_PLUS.motors[0].free_speed_mps
    expected = (0.5 - OMNI_PLUS.yaw_resistance_nm / (stall_n * arm_m)) * free_mps / arm_m
    assert w.state(1).gyro_radps[2] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("name", sorted(set(AIRFRAMES) - {"quad_x"}))
@pytest.mark.parametrize("speed_mps", [0.5, 1.5])
def test_every_rover_rolls_out(name: str, speed_mps: float) -> None:
    """v^2 / 2 c g ahead, and rest."""
    w = world((name, 0, 0))
    launch(w, speed_mps, 0.0)
    run(w, 4.0, {})
    way = speed_mps**2 / (2 * AIRFRAMES[name].rolling_resistance * GRAVITY_MPS2)
    v = w.truth().vehicles[1]
    assert v.north_m == pytest.approx(way, abs=1.5 * speed_mps * STEP_S)
    assert v.north_mps == 0.0


def test_a_quad_in_the_air_is_slowed_by_drag_alone() -> None:
    """1 / v grows by k t / m with k = rho / 2 CdA, while rotors carry the weight."""
    w = world(("quad_x", -40, 0))
    w._vehicles[1].air = w._vehicles[1].air.__class__(down_m=-20.0)
    launch(w, 8.0, 0.0)
    run(w, 4.0, {1: hover_pwm()})
    k = 0.5 * AIR_DENSITY_KGPM3 * QUAD_X.drag_area_m2
    v = w.truth().vehicles[1]
    assert 1.0 / v.north_mps - 1.0 / 8.0 == pytest.approx(k * 4.0 / QUAD_X.mass_kg, rel=0.01)
    way = QUAD_X.mass_kg / k * math.log1p(8.0 * k * 4.0 / QUAD_X.mass_kg)
    assert v.north_m == pytest.approx(way - 40.0, abs=0.05)


def test_a_quad_turns_by_the_torque_of_its_rotors() -> None:
    """Nothing but the rotors turns it in the air: w = N t / I, by their drag torques."""
    w = world(("quad_x", 0, 0))
    w._vehicles[1].air = w._vehicles[1].air.__class__(down_m=-20.0)
    outputs = pwm(mix_rotors(QUAD_X, 0.5, 0.0, 0.0, 0.02))
    run(w, 0.5, {1: outputs})
    torque_nm = sum(
        m.spin * FLIGHT.drag_torque_m * thrust_n(p) / 4.0
        for m, p in zip(QUAD_X.motors, outputs, strict=True)
    )
    expected = torque_nm * 0.5 / QUAD_X.yaw_inertia_kgm2
    assert w.state(1).gyro_radps[2] == pytest.approx(expected, rel=1e-3)


def test_a_quad_tilted_for_good_reaches_the_speed_at_which_drag_is_its_thrust() -> None:
    """sqrt(T sin a / k), with the height held by hand."""
    w, tilt = world(("quad_x", 0, -45)), math.radians(5.0)
    thrust = hover_pwm(1.0 / math.cos(tilt))
    force_n = sum(thrust_n(p) / 4.0 for p in thrust) * math.sin(tilt)
    expected = math.sqrt(force_n / (0.5 * AIR_DENSITY_KGPM3 * QUAD_X.drag_area_m2))
    launch(w, 0.0, 0.95 * expected)
    for _ in range(round(9.0 / STEP_S)):
        w._vehicles[1].air = w._vehicles[1].air.__class__(down_m=-5.0, tilt_rad=(tilt, 0.0))
        w.step({1: thrust})
    assert w.truth().vehicles[1].east_mps == pytest.approx(expected, rel=0.02)


def test_contact_between_unlike_airframes_keeps_momentum_and_makes_no_energy() -> None:
    """Every pair of rovers, off centre; only the ground's share of a step may be missing."""
    rovers = sorted(set(AIRFRAMES) - {"quad_x"})
    for one in rovers:
        for other in rovers:
            frames = {1: AIRFRAMES[one], 2: AIRFRAMES[other]}
            gap_m = 1.1 * (frames[1].radius_m + frames[2].radius_m)
            w = world((one, 0.1, 0.0), (other, 0.0, gap_m))
            launch(w, 0.0, 1.5)
            most_ns = sum(f.resistance_n("y") for f in frames.values()) * STEP_S * 1.01
            before, touched = energy_j(w, frames), False
            for _ in range(150):
                start = momentum_ns(w, frames)
                w.step({})
                after = energy_j(w, frames)
                assert math.dist(momentum_ns(w, frames), start) <= most_ns
                assert after <= before + 1e-9
                before, touched = after, touched or bool(w.contacts())
            assert touched, (one, other)


def momentum_ns(w: World, frames: dict[int, Airframe]) -> tuple[float, float]:
    bodies = w.truth().vehicles.items()
    return (
        sum(frames[s].mass_kg * v.north_mps for s, v in bodies),
        sum(frames[s].mass_kg * v.east_mps for s, v in bodies),
    )


@pytest.mark.parametrize("name", sorted(set(AIRFRAMES) - set(STATION_AIRFRAMES)))
def test_the_station_says_that_it_has_no_twin_of_it(name: str) -> None:
    vehicle = {"name": "a", "sysid": 1, "airframe": name}
    place = {"start": {"north_m": 0, "east_m": 0}, "goal": {"north_m": 0, "east_m": 0}}
    arena = {"north_min_m": -9, "north_max_m": 9, "east_min_m": -9, "east_max_m": 9}
    tree = {"name": "x", "arena": arena, "fleet": [vehicle | place], "yaw": "free"}
    with pytest.raises(InputError, match=f"a is a {name}, and the base station has no twin"):
        station_view(Scenario.model_validate(tree), 14550, 0)


def test_what_must_turn_needs_a_free_heading() -> None:
    with pytest.raises(ValueError, match="must turn to go sideways"):
        world(("skid_steer", 0, 0), yaw="locked")


# terrain


@pytest.mark.parametrize("grade", [0.05, 0.2])
def test_a_slope_pulls_what_rolls_too_easily(grade: float) -> None:
    """Downhill acceleration g sin a - c g, or rest when friction is more."""
    w = world(("omni_plus", 0, 0), terrain={"slope": {"north": grade}})
    run(w, 1.0, {})
    pull = max(0.0, GRAVITY_MPS2 * (grade / math.hypot(1, grade) - OMNI_PLUS.rolling_resistance))
    assert w.truth().vehicles[1].north_mps == pytest.approx(-pull, abs=1e-6)


def test_slope_force_is_the_weight_along_it() -> None:
    north, east = slope_force_n(Slope(north=0.3, east=-0.4), 10.0)
    along = 10.0 * GRAVITY_MPS2 * math.sin(math.atan(0.5))
    assert (north, east) == pytest.approx((-along * 0.6, along * 0.8))


def test_a_quad_without_thrust_reaches_the_speed_of_the_wind_never_more() -> None:
    w = world(("quad_x", -40, 0), terrain={"wind": {"north_mps": 6.0}})
    run(w, 1.0, {1: [FULL] * 4})
    run(w, 10.0, {1: hover_pwm()})
    assert 1.0 < w.truth().vehicles[1].north_mps < 6.0


def test_wind_adds_nothing_when_there_is_none() -> None:
    assert wind_force_n(OMNI_PLUS, Wind(), (3.0, 0.0, 0.0)) == (0.0, 0.0, 0.0)
    north, _, _ = wind_force_n(OMNI_PLUS, Wind(north_mps=10.0), (0.0, 0.0, 0.0))
    assert north == pytest.approx(0.5 * AIR_DENSITY_KGPM3 * 0.15 * 100.0)


def test_patches_change_how_far_it_rolls() -> None:
    patch = {"north_min_m": -1, "north_max_m": 9, "east_min_m": -1, "east_max_m": 9}
    for friction in (0.5, 4.0):
        w = world(("omni_plus", 0, 0), terrain={"patches": [patch | {"friction": friction}]})
        launch(w, 1.0, 0.0)
        run(w, 4.0, {})
        way = 1.0 / (2 * friction * OMNI_PLUS.rolling_resistance * GRAVITY_MPS2)
        assert w.truth().vehicles[1].north_m == pytest.approx(way, abs=STEP_S)


@pytest.mark.parametrize("listed", [False, True])
def test_a_slope_begins_and_ends(listed: bool) -> None:
    """At rest, then uniform acceleration for a second, then it rolls out."""
    slope = {"north": 0.3, "from_s": 1.0, "until_s": 2.0}
    w = world(("omni_plus", 0, 0), terrain={"slope": [slope] if listed else slope})
    run(w, 1.0, {})
    assert w.truth().vehicles[1].north_mps == 0.0
    run(w, 1.0, {})
    c = OMNI_PLUS.rolling_resistance
    speed = GRAVITY_MPS2 * (0.3 / math.hypot(1, 0.3) - c)
    here = w.truth().vehicles[1]
    assert here.north_mps == pytest.approx(-speed, abs=1e-6)
    run(w, 4.0, {})
    way = w.truth().vehicles[1].north_m - here.north_m
    assert way == pytest.approx(-(speed**2) / (2 * c * GRAVITY_MPS2), abs=speed * STEP_S)
    assert w.truth().vehicles[1].north_mps == 0.0


def test_a_gust_begins_and_ends() -> None:
    """Momentum is the force of the wind on what hardly moves, times its time."""
    gust = {"north_mps": 20.0, "from_s": 0.5, "until_s": 0.6}
    calm = {"north_mps": 0.0}
    w = world(("omni_plus", 0, 0), terrain={"wind": [gust, calm]})
    run(w, 0.5, {})
    assert w.truth().vehicles[1].north_mps == 0.0
    run(w, 0.1, {})
    force_n = 0.5 * AIR_DENSITY_KGPM3 * 0.15 * 400.0 - OMNI_PLUS.rolling_force_n
    speed = 0.1 * force_n / OMNI_PLUS.mass_kg
    assert w.truth().vehicles[1].north_mps == pytest.approx(speed, rel=0.03)
    run(w, 2.0, {})
    assert w.truth().vehicles[1].north_mps == 0.0


def test_a_patch_begins_and_ends_and_the_first_of_two_counts() -> None:
    """Ice from 0 s to 1 s over ground of twice the friction."""
    square = {"north_min_m": -40, "north_max_m": 40, "east_min_m": -40, "east_max_m": 40}
    ice = square | {"friction": 0.0, "until_s": 1.0}
    w = world(("omni_plus", 0, 0), terrain={"patches": [ice, square | {"friction": 2.0}]})
    launch(w, 2.0, 0.0)
    run(w, 1.0, {})
    assert w.truth().vehicles[1].north_m == pytest.approx(2.0)
    run(w, 4.0, {})
    way = 4.0 / (2 * 2.0 * OMNI_PLUS.rolling_resistance * GRAVITY_MPS2)
    assert w.truth().vehicles[1].north_m == pytest.approx(2.0 + way, abs=2 * STEP_S)


def test_a_slope_that_comes_later_shows_in_telemetry() -> None:
    """An accelerometer does not feel the pull of the slope, only the ground that holds back."""
    w = world(("omni_plus", 0, 0), terrain={"slope": {"north": 0.3, "from_s": 1.0}})
    run(w, 0.98, {})
    w.state(1)
    run(w, 0.02, {})
    assert w.state(1).accel_body_mps2[0] == pytest.approx(0.0, abs=1e-9)
    run(w, 0.02, {})
    state = w.state(1)
    rolling = OMNI_PLUS.rolling_resistance * GRAVITY_MPS2
    assert state.velocity_mps[0] < 0.0
    assert state.accel_body_mps2[0] == pytest.approx(rolling, abs=1e-6)


def test_data_sheets_hold_together() -> None:
    for frame in AIRFRAMES.values():
        assert isinstance(frame.flight, Flight | None)
        assert all(m.stall_force_n > 0.0 for m in frame.motors)
        if frame.flight is None:
            assert frame.axis_push_n("x") > 2.0 * frame.rolling_force_n
        else:
            assert sum(m.stall_force_n for m in frame.motors) > 1.5 * frame.weight_n
