"""What is drawn of an experiment and of a mission."""

from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import asked, experiment

from base_station.planning.laboratory import figures
from base_station.planning.laboratory.trails import of_experiment, of_mission
from base_station.planning.policy import to_setpoints
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.requests import PolicyWeights
from base_station.planning.tasks.candidates import Candidate, open_loop_plan
from base_station.twin import EAST, NORTH


@pytest.fixture
def rammed(rescue_view):
    """Rover 1 drives east into the suspect for 3.5 s: the problem and the plan."""
    problem = alpha_problem(rescue_view, experiment(rescue_view))
    actions = np.zeros((1, 16, 4))
    actions[0, :7, 1] = 1.0
    (setpoints,) = to_setpoints(actions, problem.commands)
    return problem, open_loop_plan(problem, Candidate(0.0, setpoints))


def test_trails_are_what_the_plan_predicts(rammed):
    problem, plan = rammed
    trails = of_experiment(problem, plan)
    assert trails.true_m.shape == (81, 2, 3, 2)
    assert trails.times_s[-1] == pytest.approx(8.0)
    assert trails.reported_m[::5] == pytest.approx(plan.predicted_reports.swapaxes(0, 1))
    assert (trails.reported_m[:, 1, 1, 1] == 0.0).all()  # the east GPS of the suspect is stuck
    assert trails.true_m[-1, 1, 1, 1] > 0.3


def test_the_meeting_is_found_where_the_rims_meet(rammed):
    problem, plan = rammed
    meetings = of_experiment(problem, plan).meetings
    assert {(m.h, m.pair) for m in meetings} == {(0, (0, 1)), (1, (0, 1))}
    radius_m = float(problem.model.vehicles.radius_m[1])
    first = meetings[0]
    assert first.place_m == pytest.approx([0.0, -radius_m], abs=0.1)
    assert 1.9 / 1.0 < 0.1 * first.k < 3.0  # 1.9 m at 1 m/s, and the time to get going


def test_a_mission_is_followed_until_everybody_is_home(rescue_view):
    """A policy that always drives north by 0.5 m/s; goals are 1 m north of the starts."""
    problem = beta_problem(rescue_view, asked(rescue_view, "beta"))
    north = np.tile([0.5, 0.0], 3)
    size = problem.observe(problem.start[None], problem.delivered[None], np.zeros(1, int)).shape[1]
    policy = PolicyWeights(((np.zeros((6, size)), north),))
    goals_m = problem.start[:, NORTH : EAST + 1] + np.array([1.0, 0.0])
    trails = of_mission(replace(problem, goals_m=goals_m), policy)
    assert trails.meetings == ()
    assert 1.0 < trails.times_s[-1] < 4.0
    last = np.linalg.norm(trails.true_m[-1, 0] - goals_m, axis=1)
    assert (last <= problem.radius_m + 0.5 * 0.5).all()  # at their goals, or just past them


def test_the_same_picture_is_the_same_file(rammed, tmp_path):
    problem, plan = rammed
    trails, radii_m = of_experiment(problem, plan), problem.model.vehicles.radius_m
    for name in ("a.svg", "b.svg"):
        figures.experiment(trails, ["motor_y_off", "gps_east_stuck"], radii_m, tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    goals_m = np.zeros((3, 2))
    figures.rescue(trails, goals_m, 1, radii_m, tmp_path / "rescue.png")
    assert (tmp_path / "rescue.png").stat().st_size > 5000
