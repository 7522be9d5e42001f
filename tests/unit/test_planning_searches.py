"""Planners of the experiment that do not learn, and what each can and can not find."""

from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import experiment, planning

from base_station.planning.learning.presets import PRESETS, TUNED_ALPHA
from base_station.planning.planner import plan
from base_station.planning.problems import alpha_problem
from base_station.planning.requests import encode
from base_station.planning.scripted.around import get_behind
from base_station.planning.scripted.ram import ram
from base_station.planning.searches.cem import cem
from base_station.planning.searches.gradient import gradient
from base_station.planning.searches.search import LOOK_EVERY, ROUND, search
from base_station.planning.searches.shooting import shooting, stretched
from base_station.planning.searches.stepwise import stepwise
from base_station.planning.tasks.alpha import nominal_returns
from base_station.planning.trying import SEARCHES
from base_station.twin import NORTH, initial_state


def answered(view, name, request):
    return plan(planning(view, planner=name, restarts=0), request, lambda _: None)


@pytest.mark.parametrize("name", ["cem", "shooting", "ram"])
def test_an_experiment_is_found_and_named(rescue_view, name):
    seen = []
    view = planning(rescue_view, planner=name, restarts=2)
    answer = plan(view, experiment(view), seen.append)
    assert answer.plan is not None
    assert answer.plan.predicted_error <= view.diagnosis.plan_error
    assert answer.plan.held == (1,)
    assert answer.plan.predicted_reports.shape == (2, 17, 3, 2)
    assert answer.trainings[-1].planner == name
    assert [t.accepted for t in answer.trainings] == [False] * (len(answer.trainings) - 1) + [True]
    assert seen[-1].timesteps == answer.trainings[-1].timesteps


@pytest.mark.parametrize("name", sorted(SEARCHES))
def test_the_same_request_gets_the_same_answer(rescue_view, name, monkeypatch):
    short = replace(TUNED_ALPHA, total_timesteps=LOOK_EVERY * ROUND * 16)
    monkeypatch.setitem(PRESETS, ("tuned", "alpha"), short)
    plans = [answered(rescue_view, name, experiment(rescue_view)).plan for _ in range(2)]
    if plans[0] is None:
        assert plans[1] is None
    else:
        assert plans[0].setpoints.tobytes() == plans[1].setpoints.tobytes()


def test_a_missed_target_is_tried_again_with_another_seed(rescue_view, monkeypatch):
    short = replace(TUNED_ALPHA, total_timesteps=2 * ROUND * 16)
    monkeypatch.setitem(PRESETS, ("tuned", "alpha"), short)
    strict = rescue_view.diagnosis.model_copy(update={"plan_error": 1e-300})
    view = planning(rescue_view.model_copy(update={"diagnosis": strict}), planner="cem", restarts=1)
    answer = plan(view, experiment(view), lambda _: None)
    assert answer.plan is None
    assert [(t.attempt, t.accepted) for t in answer.trainings] == [(0, False), (1, False)]
    assert answer.trainings[0].curve != answer.trainings[1].curve
    assert encode(answer)


def test_a_ram_comes_from_afar_and_random_steps_do_not(rescue_view):
    request = experiment(rescue_view, apart_m=4.3)
    assert answered(rescue_view, "ram", request).plan is not None
    problem = alpha_problem(rescue_view, request)
    aimless = next(stepwise(problem, np.random.default_rng(0)))
    assert nominal_returns(problem, aimless).max() <= 0.0


def test_the_budget_is_kept(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    done = search(problem, shooting, 0, 1e-300, 3 * ROUND * problem.steps - 1, lambda *_: None)
    assert done.timesteps == 3 * ROUND * problem.steps
    assert len(done.curve) == 3


def test_a_met_target_ends_the_search_at_the_next_look(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    done = search(problem, shooting, 0, 1.0, 10**9, lambda *_: None)
    assert done.accepted
    assert done.timesteps == LOOK_EVERY * ROUND * problem.steps


def test_the_gradient_vanishes_where_nothing_touches(rescue_view):
    paper = planning(rescue_view, objective="paper_distance")
    problem = alpha_problem(paper, experiment(paper, apart_m=3.5))
    climb = gradient(problem, np.random.default_rng(0))
    proposals = next(climb)
    returns = nominal_returns(problem, proposals)
    assert not returns.any()
    with pytest.raises(StopIteration):
        climb.send(returns)


def test_the_gradient_climbs_where_something_does(rescue_view):
    """From a plan that pushes already, ascent earns more: it is the start that it lacks."""
    paper = planning(rescue_view, objective="paper_distance")
    problem = alpha_problem(paper, experiment(paper, apart_m=0.7))
    climb = gradient(problem, np.random.default_rng(0))
    earned = []
    proposals = next(climb)
    for _ in range(6):
        returns = nominal_returns(problem, proposals)
        earned.append(returns[0])
        proposals = climb.send(returns)
    assert max(earned[1:]) > 1.5 * earned[0] > 0.0


def test_the_cross_entropy_method_improves_on_its_first_samples(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    running = cem(problem, np.random.default_rng(0))
    means = []
    proposals = next(running)
    for _ in range(12):
        returns = nominal_returns(problem, proposals)
        means.append(returns.mean())
        proposals = running.send(returns)
    assert means[-1] > means[0] + 1.0


def test_a_stretched_plan_holds_its_velocities(rescue_view):
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    knots = np.arange(16.0).reshape(1, 4, 4)
    actions = stretched(problem, knots)
    assert actions.shape == (1, 16, 4)
    assert (np.diff(actions[0, :, 0]) != 0.0).nonzero()[0].tolist() == [3, 7, 11]


def test_a_ram_drives_round_the_suspect_to_where_a_push_tells(rescue_view):
    """Helpers north of the suspect: straight ahead they would push an axis that both faults
    leave alone."""
    request = experiment(rescue_view)
    start = initial_state([[2.0, -0.6], [0.0, 0.0], [2.0, 0.6]], [0.0] * 3)
    request.states[:] = start
    problem = alpha_problem(rescue_view, request)
    proposals = next(ram(problem, np.random.default_rng(0)))
    returns = nominal_returns(problem, proposals).reshape(2, 4, 3)
    north_south, east_west = returns[:, :2].max(), returns[:, 2:].max()
    assert east_west > 2.0 * north_south
    assert answered(rescue_view, "ram", request).plan is not None


@pytest.mark.parametrize("angle", np.linspace(-3.0, 3.0, 9))
def test_whoever_gets_behind_a_disc_never_runs_into_it_on_the_way(angle):
    centre, direction = np.zeros((1, 2)), np.array([[0.0, 1.0]])
    position = 2.0 * np.array([[np.cos(angle), np.sin(angle)]])
    for _ in range(400):
        place, ready = get_behind(position, centre, direction, 0.6)
        velocity = 1.5 * (place - position)
        if ready[0]:
            break
        position = position + 0.02 * velocity / max(1.0, np.linalg.norm(velocity))
        assert np.linalg.norm(position) > 0.6
    assert ready[0]
    assert position[0, 1] < -0.6
    assert abs(position[0, NORTH]) < 0.1
