"""The Gymnasium environments: by their own checker, and against the batched tasks."""

from dataclasses import replace

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from planning_scenes import asked, experiment, planning

from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.tasks.alpha import AlphaTask
from base_station.planning.tasks.beta import BetaTask
from base_station.planning.tasks.environments import AlphaEnv, BetaEnv
from base_station.twin import FleetModel
from hil.scenario import Geofence

TERMS = {
    "paper_distance": {"distance", "wall"},
    "paper_printed": {"distance", "wall"},
    "information": {"information", "contact", "time", "energy", "wall"},
}
CASES = [*TERMS, "beta", "beta_paper"]


def scene(view, case):
    """An environment, the task it wraps, the names of its terms."""
    if case in TERMS:
        view = planning(view, objective=case)
        alpha = replace(alpha_problem(view, experiment(view)), steps=6)
        return AlphaEnv(alpha), lambda rng: AlphaTask(alpha, 1, rng), TERMS[case]
    beta = replace(beta_problem(view, asked(view, "beta", "motor_y_off")), steps=6)
    names = {"progress", "arrival", "wall", "shoved"}
    if case == "beta_paper":
        beta = replace(beta, base="paper", shaped=False, curriculum=False)
    else:
        names |= {"shaping"}
    return BetaEnv(beta), lambda rng: BetaTask(beta, 1, rng), names


@pytest.mark.filterwarnings("ignore:.*infinity")  # observations have no hard bounds
@pytest.mark.parametrize("yaw", ["locked", "free"])
@pytest.mark.parametrize("case", CASES)
def test_the_checker_of_gymnasium_is_content(rescue_view, case, yaw):
    env, _, _ = scene(rescue_view.model_copy(update={"yaw": yaw}), case)
    check_env(env, skip_render_check=True)


@pytest.mark.parametrize("case", CASES)
def test_an_environment_is_a_row_of_the_task(rescue_view, case):
    env, task_of, names = scene(rescue_view, case)
    task = task_of(np.random.default_rng(5))
    observation, _ = env.reset(seed=5)
    first = task.reset()
    for k in range(12):
        assert np.array_equal(observation, first[0].astype(np.float32))
        action = np.random.default_rng(k).uniform(-1, 1, task.action_size).astype(np.float32)
        step = task.step(action[None].astype(np.float64))
        observation, reward, terminated, truncated, info = env.step(action)
        assert reward == step.rewards[0]
        assert set(info["terms"]) == names
        assert sum(info["terms"].values()) == pytest.approx(reward, abs=1e-12)
        assert terminated == step.dones[0] == (k % 6 == 5)
        assert not truncated
        assert np.array_equal(observation, step.final_observations[0].astype(np.float32))
        first = step.observations
        if terminated:
            # the task has begun anew already; the environment does when it is told to
            observation, _ = env.reset(seed=5)
            task = task_of(np.random.default_rng(5))
            first = task.reset()


def test_each_term_is_what_its_name_says(rescue_view):
    view = planning(rescue_view, objective="information")
    problem = alpha_problem(view, experiment(view))
    start = problem.start.copy()
    start[:, 0, 1] = -0.7  # rover 1 beside the suspect
    task = AlphaTask(replace(problem, start=start), 1, np.random.default_rng(0))
    task.progress = 1.0  # no curriculum
    task.reset()
    still = task.step(np.zeros((1, 4))).terms
    assert still["contact"] == still["energy"] == still["wall"] == 0.0
    assert still["time"] == pytest.approx(-0.05, rel=0.05)
    pushing = [task.step(np.array([[0.0, 1.0, 0.0, 0.0]])).terms for _ in range(5)]
    assert sum(t["information"] for t in pushing) > 5.0
    assert sum(t["contact"] for t in pushing) < 0.0
    assert sum(t["energy"] for t in pushing) < 0.0
    assert pushing[-1]["time"] > -0.01  # nothing left to know


def test_plans_keep_inside_the_geofence_though_no_wall_is_there(rescue_view):
    fence = Geofence(north_min_m=-3.0, north_max_m=4.0, east_min_m=-4.0, east_max_m=4.5)
    view = rescue_view.model_copy(update={"geofence": fence})
    bounds_m = [-3.0, 4.0, -4.0, 4.5]
    assert alpha_problem(view, experiment(view)).model.vehicles.bounds_m.tolist() == bounds_m
    assert beta_problem(view, asked(view, "beta")).model.vehicles.bounds_m.tolist() == bounds_m
    believed = FleetModel.from_view(view).vehicles.bounds_m
    assert believed.tolist() == FleetModel.from_view(rescue_view).vehicles.bounds_m.tolist()
