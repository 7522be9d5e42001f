"""The twin's dynamics of one vehicle against closed forms."""

import math
from pathlib import Path

import numpy as np
import pytest

from base_station.belief.hypotheses import NONE, Hypothesis
from base_station.twin import (
    DRIVEN,
    EAST,
    I_X,
    I_Y,
    NORTH,
    SP_YAW,
    V_EAST,
    V_NORTH,
    YAW,
    YAW_RATE,
    FleetModel,
    advance,
    fault_rows,
    initial_state,
    perturbed,
    report,
)
from base_station.twin.drive import INTEGRATOR_LIMIT
from hil.airframe import GRAVITY_MPS2, OMNI_PLUS, mix, motor_forces
from hil.faults import Fault, Type, Unit
from hil.scenario import load_scenario, station_view

RESCUE = Path(__file__).parents[2] / "scenarios" / "rescue.yaml"
HOLD = [False]
DRIVE = [True]
NAN = math.nan
SINGLE = 1e-7  # what is not a place is a 32-bit number in the kernel: 24 bits of up to 1
HEALTHY = Hypothesis(NONE, 2, 1.0)
Y_OFF = Hypothesis("motor_y_off", 2, 1.0, Fault(Unit.MOTOR, Type.OFF, (3, 4)))
EAST_STUCK = Hypothesis("gps_east_stuck", 2, 1.0, Fault(Unit.GPS, Type.STUCK, axes=("east",)))


def lone(yaw: str = "locked") -> FleetModel:
    """Rover 2 alone in a large arena."""
    view = station_view(load_scenario(RESCUE), 14550, 1)
    arena = view.arena.model_copy(
        update={"north_min_m": -50, "north_max_m": 50, "east_min_m": -50, "east_max_m": 50}
    )
    update = {"fleet": view.fleet[1:2], "arena": arena, "yaw": yaw}
    return FleetModel.from_view(view.model_copy(update=update))


def at_rest(yaw_rad: float = 0.0) -> np.ndarray:
    return initial_state([[[0.0, 0.0]]], [[yaw_rad]])


def run(model, hypothesis, state, setpoint, driven, duration_s):
    faults = fault_rows(model, [hypothesis])
    return advance(model, model.nominal, faults, state, [setpoint], driven, duration_s).states


@pytest.mark.parametrize("yaw_rad", [0.0, math.pi / 2])
def test_a_healthy_rover_reaches_its_set_point(yaw_rad):
    state = run(lone(), HEALTHY, at_rest(yaw_rad), [0.3, -0.4, NAN], DRIVE, 15.0)
    assert state[0, 0, [V_NORTH, V_EAST]] == pytest.approx([0.3, -0.4], abs=2e-3)


def test_a_set_point_is_cut_to_the_speed_limit_in_its_direction():
    state = run(lone(), HEALTHY, at_rest(), [3.0, 4.0, NAN], DRIVE, 20.0)
    assert state[0, 0, [V_NORTH, V_EAST]] == pytest.approx([0.6, 0.8], abs=5e-3)


def test_a_coasting_rover_stops_where_rolling_resistance_stops_it():
    state = at_rest()
    state[0, 0, V_NORTH] = 0.8
    after = run(lone(), HEALTHY, state, [0, 0, NAN], HOLD, 3.0)[0, 0]
    expected_m = 0.8**2 / (2 * OMNI_PLUS.rolling_resistance * GRAVITY_MPS2)
    assert after[NORTH] == pytest.approx(expected_m, abs=0.8 * 0.02)
    assert after[V_NORTH] == 0.0


@pytest.mark.parametrize("turn_rad", [0.2, -0.2])
def test_one_step_of_driving_is_what_the_airframe_says(turn_rad):
    model, state = lone("free"), at_rest()
    state[0, 0, [V_NORTH, V_EAST, YAW_RATE, SP_YAW]] = 0.3, -0.2, 0.1, turn_rad
    state[0, 0, DRIVEN] = 1.0
    after = run(model, HEALTHY, state, [0.5, 0.1, turn_rad], DRIVE, model.dt_s)[0, 0]
    stall = OMNI_PLUS.axis_stall_force_n("x")
    rolling = OMNI_PLUS.rolling_force_n
    u = [0.5 / 1.6 + rolling / stall + after[I_X], 0.1 / 1.6 + rolling / stall + after[I_Y]]
    outputs = mix(OMNI_PLUS, *u, 2.0 * turn_rad - 0.5 * 0.1)
    fx, fy, torque = motor_forces(OMNI_PLUS, outputs, (0.3, -0.2), 0.1)
    v = np.array([0.3, -0.2]) + np.array([fx, fy]) / OMNI_PLUS.mass_kg * model.dt_s
    v *= 1.0 - OMNI_PLUS.rolling_resistance * GRAVITY_MPS2 * model.dt_s / np.linalg.norm(v)
    assert after[[V_NORTH, V_EAST]] == pytest.approx(v, abs=SINGLE)
    rate = 0.1 + torque / OMNI_PLUS.yaw_inertia_kgm2 * model.dt_s
    drag = OMNI_PLUS.yaw_resistance_nm / OMNI_PLUS.yaw_inertia_kgm2 * model.dt_s
    rate -= math.copysign(min(drag, abs(rate)), rate)
    assert after[YAW_RATE] == pytest.approx(rate, abs=SINGLE)


@pytest.mark.parametrize("target_rad", [1.5, -1.5, math.pi - 0.01])
def test_a_free_yaw_turns_to_its_set_point_either_way(target_rad):
    state = run(lone("free"), HEALTHY, at_rest(), [0, 0, target_rad], DRIVE, 6.0)
    # the loop has no integrator: yaw resistance stops it where 12.8 N m per rad can't beat it
    assert state[0, 0, YAW] == pytest.approx(target_rad, abs=0.03)


def test_a_locked_yaw_never_changes():
    state = run(lone(), HEALTHY, at_rest(0.4), [0.5, 0.5, 2.0], DRIVE, 3.0)
    assert state[0, 0, YAW] == at_rest(0.4)[0, 0, YAW]
    assert state[0, 0, YAW_RATE] == 0.0


def test_dead_y_motors_leave_only_the_x_axis():
    state = run(lone(), Y_OFF, at_rest(), [0.5, 0.5, NAN], DRIVE, 10.0)[0, 0]
    assert state[EAST] == 0.0
    assert state[V_NORTH] == pytest.approx(0.5, abs=5e-3)


def test_a_stuck_gps_winds_the_integrator_to_its_bound_only():
    state = run(lone(), EAST_STUCK, at_rest(), [0.0, 0.4, NAN], DRIVE, 20.0)[0, 0]
    assert state[I_Y] == pytest.approx(INTEGRATOR_LIMIT, abs=SINGLE)
    assert state[V_EAST] == pytest.approx(0.4 + INTEGRATOR_LIMIT * 1.6, abs=2e-3)
    held = run(lone(), EAST_STUCK, state[None, None], [0, 0, NAN], HOLD, 0.02)[0, 0]
    assert held[[I_X, I_Y]].tolist() == [0.0, 0.0]


def test_a_stuck_axis_reports_what_it_held():
    model = lone()
    faults = fault_rows(model, [EAST_STUCK])
    state = run(model, EAST_STUCK, at_rest(), [0.4, 0.4, NAN], DRIVE, 4.0)
    assert state[0, 0, EAST] > 1.0
    assert report(state, faults)[0, 0].tolist() == [state[0, 0, NORTH], 0.0]


def test_commanding_only_the_suspect_tells_nothing():
    """D = 0: both explanations predict the same telemetry, however the doubted axis is driven."""
    model = lone()
    faults = fault_rows(model, [Y_OFF, EAST_STUCK])
    states = np.repeat(at_rest(), 2, axis=0)
    for east_mps in (0.3, 1.0, -0.7, 0.0, 0.5):
        command = [[0.0, east_mps, NAN]]
        states = advance(model, model.nominal, faults, states, command, DRIVE, 0.5).states
        reports = report(states, faults)
        assert reports[0].tolist() == reports[1].tolist()
    assert abs(states[0, 0, EAST] - states[1, 0, EAST]) > 0.1  # their true states do differ


def test_latency_delays_a_set_point_and_is_cut_to_the_call():
    model = lone()
    faults, late = fault_rows(model, [HEALTHY]), model.nominal._replace(latency_s=np.array([0.1]))
    setpoint = [[0.5, 0.0, NAN]]
    waiting = advance(model, late, faults, at_rest(), setpoint, DRIVE, 0.1).states
    assert waiting[0, 0, NORTH] == 0.0
    moved = advance(model, late, faults, waiting, setpoint, DRIVE, 0.5).states
    prompt = advance(model, model.nominal, faults, at_rest(), setpoint, DRIVE, 0.5).states
    assert moved[0, 0, NORTH] == prompt[0, 0, NORTH]


def test_batch_rows_do_not_touch_each_other_and_repeat_to_the_bit():
    model = lone()
    faults = fault_rows(model, [Y_OFF, EAST_STUCK])
    draws = perturbed(model, np.random.default_rng(3), 4)
    states = np.repeat(at_rest(), 8, axis=0)
    whole = advance(model, draws, faults, states, [[0.5, 0.2, NAN]], DRIVE, 1.0).states
    for p in range(4):
        one = type(draws)(*(x[p : p + 1] for x in draws))
        pair = advance(model, one, faults, states[:2], [[0.5, 0.2, NAN]], DRIVE, 1.0).states
        assert np.array_equal(whole[2 * p : 2 * p + 2], pair)
    assert len({float(x) for x in whole[:, 0, NORTH]}) > 4  # the draws do differ


def test_two_steps_are_one_of_their_length_to_the_bit():
    """A state holds all there is: nothing is lost between two calls."""
    model, faults = lone("free"), fault_rows(lone("free"), [HEALTHY])
    setpoint = [[0.51, 0.23, 0.7]]
    whole = advance(model, model.nominal, faults, at_rest(0.4), setpoint, DRIVE, 0.6).states
    half = advance(model, model.nominal, faults, at_rest(0.4), setpoint, DRIVE, 0.3).states
    assert np.array_equal(
        whole, advance(model, model.nominal, faults, half, setpoint, DRIVE, 0.3).states
    )


def test_rows_that_do_not_divide_are_refused():
    model = lone()
    faults = fault_rows(model, [Y_OFF, EAST_STUCK])
    with pytest.raises(ValueError, match="3 batch rows do not divide"):
        advance(model, model.nominal, faults, np.repeat(at_rest(), 3, 0), [[0, 0, NAN]], HOLD, 0.1)


def test_unknown_has_no_twin():
    with pytest.raises(ValueError, match="has no twin"):
        fault_rows(lone(), [Hypothesis("unknown", 2, 0.1)])
