"""Contacts in the twin: pushing, collisions, walls, chains, many vehicles."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from base_station.belief.hypotheses import NONE, Hypothesis
from base_station.twin import (
    EAST,
    NORTH,
    STATE_SIZE,
    V_EAST,
    V_NORTH,
    YAW_RATE,
    FleetModel,
    advance,
    fault_rows,
    initial_state,
    perturbed,
)
from base_station.twin.search import near_pairs
from hil.airframe import OMNI_PLUS
from hil.scenario import FleetMember, Uncertainty, load_scenario, station_view

RESCUE = Path(__file__).parents[2] / "scenarios" / "rescue.yaml"
NAN = math.nan
STILL = [0.0, 0.0, NAN]


def fleet(
    count: int, half_size_m: float = 50.0, yaw: str = "locked", unsure: Uncertainty | None = None
) -> FleetModel:
    view = station_view(load_scenario(RESCUE), 14550, 1)
    sides = ("north_min_m", "north_max_m", "east_min_m", "east_max_m")
    signs = (-1, 1, -1, 1)
    arena = view.arena.model_copy(
        update={k: s * half_size_m for k, s in zip(sides, signs, strict=True)}
    )
    member: FleetMember = view.fleet[0]
    members = tuple(member.model_copy(update={"sysid": i + 1}) for i in range(count))
    changed = {"fleet": members, "arena": arena, "yaw": yaw}
    changed["uncertainty"] = unsure or view.uncertainty
    return FleetModel.from_view(view.model_copy(update=changed))


def healthy(model: FleetModel):
    return fault_rows(model, [Hypothesis(NONE, 1, 1.0)])


def without_resistance(model: FleetModel):
    zero = np.zeros((1, model.size))
    return model.nominal._replace(rolling_force_n=zero, yaw_resistance_nm=zero)


def energy_j(states: np.ndarray) -> float:
    moving = states[..., V_NORTH] ** 2 + states[..., V_EAST] ** 2
    turning = states[..., YAW_RATE] ** 2
    total = OMNI_PLUS.mass_kg * moving + OMNI_PLUS.yaw_inertia_kgm2 * turning
    return float(0.5 * total.sum())


@pytest.mark.parametrize("pushed", [1, 2])
def test_pushing_speed_is_where_the_motors_balance_all_rolling_resistance(pushed):
    model = fleet(1 + pushed)
    start = initial_state([[[0.0, 0.6 * i] for i in range(1 + pushed)]], [[0.0] * (1 + pushed)])
    after = advance(
        model,
        model.nominal,
        healthy(model),
        start,
        [[0.0, 1.0, NAN]] + [STILL] * pushed,
        [True] + [False] * pushed,
        15.0,
    )
    rolling, stall = OMNI_PLUS.rolling_force_n, OMNI_PLUS.axis_stall_force_n("y")
    output = 1.0 / 1.6 + rolling / stall + 0.1  # feed-forward and the integrator at its bound
    expected_mps = 1.6 * (output - (1 + pushed) * rolling / stall)
    assert after.states[0, :, V_EAST] == pytest.approx([expected_mps] * (1 + pushed), rel=0.03)
    gaps = np.diff(after.states[0, :, EAST])
    assert gaps == pytest.approx([0.6] * pushed, abs=0.01)


def test_the_push_is_as_strong_as_what_it_overcomes():
    model = fleet(2)
    start = initial_state([[[0.0, 0.0], [0.0, 0.6]]], [[0.0, 0.0]])
    commands = [[0.0, 1.0, NAN], STILL]
    steady = advance(
        model, model.nominal, healthy(model), start, commands, [True, False], 10.0
    ).states
    push = advance(model, model.nominal, healthy(model), steady, commands, [True, False], 1.0)
    assert push.impulses_ns[0, 0, 1] == pytest.approx(OMNI_PLUS.rolling_force_n * 1.0, rel=0.02)
    assert push.impulses_ns[0, 1, 0] == push.impulses_ns[0, 0, 1]


def test_a_collision_keeps_momentum_and_leaves_no_bounce():
    model = fleet(2)
    start = initial_state([[[0.0, 0.0], [0.0, 1.0]]], [[0.0, 0.0]])
    start[0, :, V_EAST] = 1.0, -0.2
    after = advance(
        model, without_resistance(model), healthy(model), start, [STILL] * 2, [False] * 2, 1.0
    )
    assert after.states[0, :, V_EAST] == pytest.approx([0.4, 0.4], abs=1e-6)
    assert after.impulses_ns[0, 0, 1] == pytest.approx(0.6 * OMNI_PLUS.mass_kg, rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), st.sampled_from(["locked", "free"]))
def test_energy_never_rises_without_motors(seed, yaw):
    rng = np.random.default_rng(seed)
    model = fleet(4, 1.5, yaw)
    corners = np.array([[-0.7, -0.7], [-0.7, 0.7], [0.7, -0.7], [0.7, 0.7]])
    states = initial_state([corners + rng.uniform(-0.3, 0.3, (4, 2))], [[0.0] * 4])
    states[0, :, [V_NORTH, V_EAST]] = rng.uniform(-1.5, 1.5, (2, 4))
    parameters = without_resistance(model)._replace(friction=rng.uniform(0.0, 0.5, 1))
    before = energy_j(states)
    for _ in range(60):
        states = advance(
            model, parameters, healthy(model), states, [STILL] * 4, [False] * 4, 0.02
        ).states
        after = energy_j(states)
        assert after <= before * (1 + 1e-6) + 1e-9
        before = after


def test_friction_turns_a_free_rover_and_only_that():
    for yaw, turns in (("free", True), ("locked", False)):
        model = fleet(2, yaw=yaw)
        start = initial_state([[[0.0, 0.0], [0.4, 0.7]]], [[0.0, 0.0]])
        start[0, 0, V_EAST] = 1.0
        after = advance(
            model, without_resistance(model), healthy(model), start, [STILL] * 2, [False] * 2, 1.0
        ).states
        assert bool(abs(after[0, 0, YAW_RATE]) > 0.01) is turns


def test_a_wall_stops_a_rover_and_is_noticed():
    model = fleet(2, 2.0)
    start = initial_state([[[0.0, 0.0], [1.0, 0.0]]], [[0.0, 0.0]])
    after = advance(
        model, model.nominal, healthy(model), start, [[0.0, 1.0, NAN], STILL], [True, False], 5.0
    )
    assert after.states[0, 0, EAST] == pytest.approx(2.0 - OMNI_PLUS.radius_m, abs=1e-6)
    assert after.walls[0].tolist() == [True, False]


@pytest.mark.parametrize("to_north_m", [0.0, 1.0])
def test_an_obstacle_stops_a_rover_where_it_stands(to_north_m):
    """A round one, and one end of a stroke across the way."""
    model = fleet(1)
    obstacle = np.array([[0.0, 2.0, to_north_m, 2.0, 0.25]])
    model = FleetModel(model.sysids, model.vehicles._replace(obstacles_m=obstacle), model.nominal)
    start = initial_state([[[0.0, 0.0]]], [[0.0]])
    after = advance(model, model.nominal, healthy(model), start, [[0.0, 1.0, NAN]], [True], 5.0)
    stop_m = 2.0 - 0.25 - OMNI_PLUS.radius_m
    assert after.states[0, 0, EAST] == pytest.approx(stop_m, abs=1e-3)
    assert after.walls[0].tolist() == [True]


def test_overlapping_rovers_come_apart():
    model = fleet(2)
    start = initial_state([[[0.0, 0.0], [0.0, 0.4]]], [[0.0, 0.0]])
    after = advance(
        model, model.nominal, healthy(model), start, [STILL] * 2, [False] * 2, 0.5
    ).states
    assert after[0, 1, EAST] - after[0, 0, EAST] == pytest.approx(0.6, abs=1e-3)
    assert energy_j(after) == 0.0


def test_the_search_by_cells_finds_the_pairs_that_looking_at_all_finds():
    count = 60
    rng = np.random.default_rng(0)
    s = initial_state(rng.uniform(-4.0, 4.0, (count, 2)), np.zeros(count))
    tile = np.append(s, np.zeros((1, STATE_SIZE)), axis=0)[:, :, None]
    pairs = np.empty((10 * count, 2), np.uintp)
    n = near_pairs(tile, np.full(count, 0.3), 0.1, pairs)
    near = [
        (i, j)
        for i in range(count)
        for j in range(i + 1, count)
        if np.hypot(*(s[i, NORTH : EAST + 1] - s[j, NORTH : EAST + 1])) < 0.7
    ]
    assert len(near) > 20
    assert sorted((int(i), int(j)) for i, j in pairs[:n]) == near


def test_coarse_steps_agree_with_fine_ones():
    """0.02 s against 0.005 s over an approach and a push: the world runs at the latter."""
    model = fleet(2)
    fine = FleetModel(model.sysids, model.vehicles._replace(dt_s=0.005), model.nominal)
    start = initial_state([[[0.0, -1.5], [0.1, 0.0]]], [[0.0, 0.0]])
    ends = [
        advance(m, m.nominal, healthy(m), start, [[0, 0.8, NAN], STILL], [True, False], 4.0).states
        for m in (model, fine)
    ]
    assert ends[0][0, 1, EAST] > 0.5
    assert ends[0][0, :, : EAST + 1] == pytest.approx(ends[1][0, :, : EAST + 1], abs=0.04)


def test_draws_stay_within_what_is_declared():
    model = fleet(2)
    draws = perturbed(model, np.random.default_rng(0), 4000)
    gain = draws.stall_force_n / model.nominal.stall_force_n
    assert gain.std() == pytest.approx(0.03, rel=0.05)
    assert (draws.mass_kg / OMNI_PLUS.mass_kg).std() == pytest.approx(0.02, rel=0.05)
    deceleration = draws.rolling_force_n / draws.mass_kg
    assert (deceleration / deceleration.mean()).std() == pytest.approx(0.10, rel=0.05)
    assert 0.0 <= draws.friction.min() <= draws.friction.max() <= 0.3
    assert 0.0 <= draws.latency_s.min() <= draws.latency_s.max() <= 0.1
    assert (draws.free_speed_mps == model.nominal.free_speed_mps).all()


def test_the_view_declares_the_ranges():
    """Draws of the other parameters are the same, whether the free speed is unsure or not."""
    unsure = Uncertainty(free_speed_sigma=0.05, friction_max=0.1, latency_max_s=0.02)
    model = fleet(2, unsure=unsure)
    draws = perturbed(model, np.random.default_rng(0), 4000)
    speed = draws.free_speed_mps / model.nominal.free_speed_mps
    assert speed.std() == pytest.approx(0.05, rel=0.05)
    assert draws.friction.max() == pytest.approx(0.1, rel=0.01)
    assert draws.latency_s.max() == pytest.approx(0.02, rel=0.01)
    plain = perturbed(fleet(2), np.random.default_rng(0), 4000)
    assert (plain.mass_kg == draws.mass_kg).all()
