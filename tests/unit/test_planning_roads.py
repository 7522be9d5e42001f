"""Scripted driving among obstacles: the way is clear, short, and leads there."""

from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import asked, experiment, planning, walled

from base_station.planning.planner import plan
from base_station.planning.problems import beta_problem
from base_station.planning.scripted.push import push
from base_station.planning.scripted.roads import GAP_M, Roads, barred
from base_station.planning.tasks.beta import brought_home
from base_station.twin import initial_state

RADIUS_M = 0.3
LOW, HIGH = np.array([-5.0, -5.0]), np.array([5.0, 5.0])
DISC = np.array([[0.0, 0.0, 0.0, 0.0, 1.0]])
HOOK = np.array([[-2.0, 0.0, 2.0, 0.0, 0.1], [2.0, 0.0, 2.0, -3.0, 0.1]])


def driven(roads: Roads, start: tuple[float, float], end: tuple[float, float]) -> np.ndarray:
    """The way of a point at 2 cm a step, [K, 2]."""
    here, there, way = np.array([start]), np.array([end]), [np.array(start)]
    for _ in range(2000):
        left = roads.towards(here, there) - here
        here = here + left * min(1.0, 0.02 / max(1e-12, float(np.linalg.norm(left))))
        way.append(here[0])
        if np.linalg.norm(here - there) < 1e-6:
            break
    return np.array(way)


def to_stroke(points: np.ndarray, stroke: np.ndarray) -> np.ndarray:
    """Distances [K] to the stroke's line, by looking at 1,000 points of it."""
    share = np.linspace(0.0, 1.0, 1000)[:, None]
    line = stroke[:2] + share * (stroke[2:4] - stroke[:2])
    return np.linalg.norm(points[:, None] - line, axis=-1).min(axis=1)


def test_round_a_disc_the_way_is_nearly_the_shortest():
    """Two tangents and an arc, 0.1 m off the rim."""
    way = driven(Roads.of(DISC, RADIUS_M, LOW, HIGH), (0.0, -3.0), (0.0, 3.0))
    clear = 1.0 + RADIUS_M + GAP_M
    shortest = 2 * np.sqrt(9.0 - clear**2) + clear * (np.pi - 2 * np.arccos(clear / 3.0))
    length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    assert np.linalg.norm(way, axis=1).min() >= clear - 1e-6
    assert shortest <= length <= 1.1 * shortest


@pytest.mark.parametrize("start", [(0.0, -1.0), (1.4, -0.7), (-4.0, -4.0), (0.0, -0.45)])
def test_out_of_a_hook_it_finds_and_touches_nothing(start):
    """The last one stands closer to the wall than it would drive."""
    way = driven(Roads.of(HOOK, RADIUS_M, LOW, HIGH), start, (1.5, 2.0))
    assert np.allclose(way[-1], (1.5, 2.0), atol=1e-6)
    assert min(to_stroke(way, stroke).min() for stroke in HOOK) >= 0.1 + RADIUS_M


def test_where_there_is_no_way_it_goes_straight():
    across = np.array([[-5.0, 0.0, 5.0, 0.0, 0.1]])
    roads = Roads.of(across, RADIUS_M, LOW, HIGH)
    assert roads.towards(np.array([[0.0, -1.0]]), np.array([[0.0, 1.0]])).tolist() == [[0.0, 1.0]]


def test_a_line_is_barred_by_what_it_crosses_or_comes_too_near():
    wall = np.array([[-1.0, 0.0, 1.0, 0.0, 0.0]])
    starts = np.array([[0.0, -1.0], [1.1, -1.0], [1.5, -1.0], [0.0, -0.1], [0.0, -0.1]])
    ends = np.array([[0.0, 1.0], [1.1, 1.0], [1.5, 1.0], [0.0, -1.0], [0.0, 1.0]])
    found = barred(starts, ends, wall, np.array([0.3]))
    assert found.tolist() == [True, True, False, False, True]


def home(problem) -> float:
    return float(brought_home(problem, push(problem), np.random.default_rng(3), 16).mean())


def test_the_scripted_drive_leaves_a_dead_end(rescue_view):
    """Rover 3 stands in a pocket that is open to the south; its goal is north of it."""
    start = initial_state([[0.0, -2.5], [0.0, 0.0], [-0.5, 2.5]], [0.0] * 3)
    pocket = [(0.5, 1.7, 0.5, 3.3, 0.1), (-1.2, 1.7, 0.5, 1.7, 0.1), (-1.2, 3.3, 0.5, 3.3, 0.1)]
    problem = beta_problem(walled(rescue_view, *pocket), asked(rescue_view, "beta"))
    moved = problem.goals_m.copy()
    moved[2] = (3.0, 2.5)
    assert home(replace(problem, start=start, goals_m=moved)) >= 0.9


def test_it_pushes_first_where_driving_first_is_barred(rescue_view):
    """Rover 2 drives north and south only; a disc is in its way there, so first it is pushed."""
    request = asked(rescue_view, "beta", "motor_y_off")
    disc = (1.6, 0.0, 1.6, 0.0, 0.3)
    assert home(beta_problem(walled(rescue_view, disc), request)) >= 0.9


def test_a_ram_comes_round_a_wall(rescue_view):
    """Both helpers are behind walls of their own."""
    walls = (-1.0, -2.0, 1.0, -2.0, 0.05), (-1.0, 2.0, 1.0, 2.0, 0.05)
    view = planning(walled(rescue_view, *walls), planner="ram", restarts=0, alpha_horizon_s=12.0)
    answer = plan(view, experiment(view, apart_m=3.0), lambda _: None)
    assert answer.plan is not None
    assert {c.between for c in answer.plan.prediction.contacts} <= {(1, 2), (2, 3)}
