"""The scripted rescue: where it can, and where nothing can."""

from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import asked

from base_station.planning.problems import beta_problem
from base_station.planning.scripted.push import push
from base_station.planning.tasks.beta import brought_home
from base_station.twin import initial_state


def home(problem, n=32) -> float:
    rng = np.random.default_rng(3)
    return float(brought_home(problem, push(problem), rng, n).mean())


@pytest.mark.parametrize("fault", ["motor_y_off", "motor_x_off"])
def test_the_rescue_layout_is_feasible(rescue_view, fault):
    assert home(beta_problem(rescue_view, asked(rescue_view, "beta", fault))) >= 0.95


@pytest.mark.parametrize("starts", [[-0.7, 0.0, 2.5], [-2.5, 0.0, 0.7]])
def test_so_is_what_an_experiment_leaves_behind(rescue_view, starts):
    problem = beta_problem(rescue_view, asked(rescue_view, "beta", "motor_y_off"))
    start = initial_state([[0.0, east] for east in starts], [0.0] * 3)
    assert home(replace(problem, start=start)) >= 0.95


def test_a_healthy_fleet_drives_home(rescue_view):
    assert home(beta_problem(rescue_view, asked(rescue_view, "beta"))) >= 0.95


def test_in_no_time_nothing_is_feasible(rescue_view):
    problem = beta_problem(rescue_view, asked(rescue_view, "beta", "motor_y_off"))
    assert home(replace(problem, steps=8)) == 0.0


def test_only_who_is_commanded_moves_and_none_too_fast(rescue_view):
    problem = beta_problem(rescue_view, asked(rescue_view, "beta", "motor_y_off"))
    states, play = problem.start[None], push(problem)
    actions = play(states, np.zeros((1, 3), dtype=np.bool_), 0)
    assert actions.shape == (1, problem.commands.size)
    assert np.linalg.norm(actions.reshape(3, 2), axis=1).max() <= 1.0 + 1e-12
    assert not play(states, np.ones((1, 3), dtype=np.bool_), 0).any()
