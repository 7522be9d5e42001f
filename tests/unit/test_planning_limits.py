"""What an experiment may do, and what a plan says of itself before it is driven."""

from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import experiment, planning, walled

from base_station.planning.planner import plan
from base_station.planning.policy import to_setpoints
from base_station.planning.problems import alpha_problem
from base_station.planning.requests import PlanReady, decode, encode
from base_station.planning.tasks.alpha import nominal_returns
from base_station.planning.tasks.candidates import Candidate, best_of, open_loop_plan, predicted
from base_station.planning.tasks.evaluation import INVALID
from base_station.planning.tasks.limits import clearance_m, closing_mps
from base_station.steps.diagnosing import announced
from base_station.twin import NORTH, V_EAST, FleetModel, initial_state
from hil.scenario import Geofence, StationView
from hil.scenario.station import Safety


def limited(view: StationView, **manoeuvre) -> StationView:
    limits = view.limits.model_dump() | {"manoeuvre": manoeuvre}
    return view.model_copy(update={"limits": type(view.limits)(**limits)})


def rammed(speed: float = 1.0, by: int = 0) -> np.ndarray:
    """Actions [1, 16, 4]: rover 1 (or 3) straight into the suspect for 3.5 s."""
    actions = np.zeros((1, 16, 4))
    actions[0, :7, 1 if by == 0 else 3] = speed if by == 0 else -speed
    return actions


def error_of(view: StationView, actions: np.ndarray) -> float:
    problem = alpha_problem(view, experiment(view))
    return best_of(problem, actions, np.random.default_rng(0)).error


def test_without_limits_a_ram_is_a_good_plan(rescue_view):
    assert error_of(rescue_view, rammed()) < 0.01


@pytest.mark.parametrize(
    ("given", "speed"),
    [
        ({"contact_speed_mps": 0.6}, 1.0),
        ({"contact_impulse_ns": 0.5}, 1.0),
        ({"contacts": "none"}, 1.0),
        ({"untouchable": (2,)}, 1.0),
        ({"untouchable": (1,)}, 1.0),
        ({"wall_margin_m": 2.5}, 1.0),
    ],
)
def test_a_plan_beyond_a_limit_is_thrown_away_and_costs_reward(rescue_view, given, speed):
    view = limited(rescue_view, **given)
    assert error_of(view, rammed(speed)) == INVALID
    free, priced = (
        nominal_returns(alpha_problem(v, experiment(v)), rammed(speed)) for v in (rescue_view, view)
    )
    assert priced < free - 0.9


@pytest.mark.parametrize(
    ("given", "speed"),
    [
        ({"contact_speed_mps": 1.2}, 1.0),
        ({"contact_speed_mps": 0.9}, 0.7),
        ({"contacts": "suspect"}, 1.0),
        ({"untouchable": (3,)}, 1.0),
        ({"wall_margin_m": 0.5}, 1.0),
    ],
)
def test_one_within_them_is_as_good_as_before(rescue_view, given, speed):
    assert error_of(limited(rescue_view, **given), rammed(speed)) == pytest.approx(
        error_of(rescue_view, rammed(speed))
    )


def test_a_suspect_that_stands_at_a_wall_may_be_pushed_along_it(rescue_view):
    """Its autopilot drove it there while nobody spoke to it: every plan that moves it brushes."""
    request = experiment(rescue_view)
    north_m = rescue_view.arena.north_min_m + rescue_view.fleet[1].frame.radius_m - 0.01
    request.states[..., :, NORTH] = north_m + 1.0
    request.states[:, 1, NORTH] = north_m
    found = plan(rescue_view, request, lambda _: None)
    assert found.plan is not None
    assert found.plan.predicted_error < rescue_view.diagnosis.plan_error


def test_helpers_must_not_touch_each_other_when_only_the_suspect_may_be_touched(rescue_view):
    """Rover 3 has been put next to rover 1, far from the suspect."""
    request = experiment(rescue_view)
    request.states[:] = initial_state([[0.0, -2.5], [0.0, 0.0], [0.0, -1.6]], [0.0] * 3)
    actions = np.zeros((1, 16, 4))
    actions[0, :3, 1] = 0.5
    for contacts, valid in (("any", True), ("suspect", False)):
        view = limited(rescue_view, contacts=contacts)
        error = best_of(alpha_problem(view, request), actions, np.random.default_rng(0)).error
        assert (error < INVALID) == valid


def test_closing_speed_and_clearance_in_closed_form(rescue_view):
    states = initial_state([[0.0, 0.0], [0.0, 2.0], [2.0, 0.0]], [0.0] * 3)[None]
    states[0, 0, V_EAST], states[0, 1, V_EAST] = 0.7, -0.2
    closing = closing_mps(states)[0]
    assert closing[0, 1] == closing[1, 0] == pytest.approx(0.9)
    assert closing[0, 2] == pytest.approx(0.0)
    model = FleetModel.from_view(rescue_view)  # north -3 to 6, east -5 to 5
    assert clearance_m(states, model)[0] + model.vehicles.radius_m == pytest.approx([3, 3, 4])


def test_the_margin_counts_from_obstacles_too(rescue_view):
    """A wall 0.5 m wide along the drive of rover 1; its rims are 0.6 m apart at the end of it."""
    beside = walled(rescue_view, (1.15, -4.0, 1.15, 0.0, 0.25))
    model = FleetModel.from_view(beside)
    states = initial_state([[0.0, -2.5], [0.0, 1.0], [2.4, -1.0]], [0.0] * 3)[None]
    radius = float(model.vehicles.radius_m[0])
    past_the_end = np.hypot(1.15, 1.0)
    expected = np.array([[1.15, past_the_end, 1.25]]) - 0.25 - radius
    assert clearance_m(states, model) == pytest.approx(expected)
    room = float(expected[0, 0])
    for margin_m, valid in ((room - 0.2, True), (room + 0.1, False)):
        error = error_of(limited(beside, wall_margin_m=margin_m), rammed())
        assert (error < INVALID) == valid


@pytest.mark.parametrize(("east_max_m", "valid"), [(4.9, True), (3.1, False)])
def test_a_geofence_is_as_good_as_a_wall(rescue_view, east_max_m, valid):
    """Rover 3, 0.3 m in radius, drives from 2.5 m east to 3.0 m: over the second fence."""
    fence = Geofence(north_min_m=-3.0, north_max_m=6.0, east_min_m=-5.0, east_max_m=east_max_m)
    view = rescue_view.model_copy(update={"geofence": fence})
    actions = rammed()
    actions[0, :2, 3] = 0.5
    assert (error_of(view, actions) < INVALID) == valid


def test_who_touches_a_wall_is_thrown_away(rescue_view):
    into = rammed()
    into[0, :, 3] = 1.0  # meanwhile rover 3 drives into the eastern wall, 2.2 m away
    assert error_of(rescue_view, into) == INVALID


@pytest.mark.parametrize("planner", ["shooting", "ram"])
def test_no_plan_takes_longer_than_is_allowed(rescue_view, planner):
    view = planning(rescue_view, planner=planner, alpha_horizon_s=5.0, restarts=2)
    answer = plan(view, experiment(view, apart_m=1.5), lambda _: None)
    assert answer.plan is not None
    assert len(answer.plan.setpoints) * answer.plan.period_s == 5.0
    assert answer.plan.prediction.duration_s == 5.0


def test_a_plan_states_what_it_is_expected_to_bring_and_to_cost(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    (setpoints,) = to_setpoints(rammed(), problem.commands)
    told = predicted(problem, setpoints)
    assert told.open_bits == pytest.approx(1.0)  # two explanations, equally likely
    assert 0.95 < told.information_low_bits <= told.information_bits + 1e-9 <= 1.0 + 1e-8
    (contact,) = told.contacts
    assert contact.between == (1, 2)
    assert 1.0 < contact.speed_mps < 1.2  # 1 m/s commanded; the strongest of uncertain motors
    assert contact.impulse_ns > 1.0
    assert told.duration_s == 8.0
    assert told.energy_j > 1.0
    idle = predicted(problem, np.where(np.isnan(setpoints), np.nan, 0.0))
    assert (idle.contacts, idle.information_bits) == ((), pytest.approx(0.0, abs=1e-9))
    assert idle.cost < told.cost


def test_it_is_said_before_it_is_driven_and_survives_the_pipe(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    found = Candidate(0.001, to_setpoints(rammed(), problem.commands)[0])
    made = open_loop_plan(problem, found)
    line = announced(made)
    assert line.startswith("plan alpha: predicted error 0.001 over 8.0 s; 1.00 of 1.00 bit")
    assert "1 and 2 touch" in line
    assert f"cost {made.prediction.cost:.2f} of 10;" in line
    answer = decode(encode(PlanReady(1, "alpha", (), made)))
    assert isinstance(answer, PlanReady)
    assert answer.plan is not None
    assert answer.plan.prediction == made.prediction
    assert "no contact" in announced(
        replace(made, prediction=replace(made.prediction, contacts=()))
    )


def test_a_planner_keeps_to_a_speed_limit(rescue_view):
    """Cross-entropy search, priced and hard: a plan is found, and it meets gently."""
    view = planning(limited(rescue_view, contact_speed_mps=0.6), planner="cem", restarts=3)
    answer = plan(view, experiment(view, apart_m=1.5), lambda _: None)
    assert answer.plan is not None
    assert answer.plan.prediction.contacts
    assert max(c.speed_mps for c in answer.plan.prediction.contacts) <= 0.6


def test_where_vehicles_are_real_their_safety_limits_count_too(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    assert not problem.limits.any
    gentle = rescue_view.model_copy(update={"safety": Safety(allow_contact=True)})
    limits = alpha_problem(gentle, experiment(gentle)).limits
    assert (limits.speed_mps, limits.margin_m) == (0.3, 0.5)
    assert limits.may_touch.all()
    apart = rescue_view.model_copy(update={"safety": Safety(allow_contact=False)})
    assert not alpha_problem(apart, experiment(apart)).limits.may_touch.any()
