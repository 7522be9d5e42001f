"""Attempts side by side: the lowest-numbered success wins, whoever is first."""

from dataclasses import replace
from itertools import permutations

import pytest
from planning_scenes import experiment, planning

from base_station.planning.attempts import Attempt
from base_station.planning.planner import plan
from base_station.planning.requests import encode
from base_station.planning.team import Board, Team, team_size
from hil.errors import ProcessDiedError
from hil.scenario import StationView


def attempt(k: int, accepted: bool) -> Attempt:
    return Attempt(accepted, k, 0.0, ())


@pytest.mark.parametrize("order", list(permutations(range(4))))
def test_the_winner_does_not_depend_on_who_is_first(order):
    """Attempts 1 and 3 meet the target."""
    board = Board(4)
    assert [board.due() for _ in range(5)] == [0, 1, 2, 3, None]
    for k in order:
        if not board.unwanted(k):
            board.enter(k, attempt(k, k in (1, 3)))
    assert [a.timesteps for a in board.result()] == [0, 1]


def test_nothing_is_begun_after_a_success_and_only_later_ones_are_unwanted():
    board = Board(9)
    assert [board.due() for _ in range(3)] == [0, 1, 2]
    board.enter(1, attempt(1, True))
    assert board.due() is None
    assert [board.unwanted(k) for k in range(3)] == [False, False, True]


def test_without_a_success_all_are_told():
    board = Board(2)
    for k in (board.due(), board.due()):
        board.enter(k, attempt(k, False))
    assert [a.accepted for a in board.result()] == [False, False]


def test_a_core_is_left_for_the_station():
    assert [team_size(0, cores) for cores in (1, 2, 8)] == [1, 1, 7]
    assert team_size(3, 2) == 3


def cold(view: StationView) -> None:
    """Workers that need no warming up."""


def dead(view: StationView) -> None:  # noqa: ARG001
    raise SystemExit(1)


def test_side_by_side_as_one_after_the_other(rescue_view):
    """From here the first ascent ends where it began, and the second one climbs."""
    view = planning(rescue_view, planner="gradient", objective="paper_distance", restarts=3)
    seen = []
    asked = experiment(view, apart_m=0.7, seed=2)
    with Team(view, 2, cold) as team:
        together = [plan(view, asked, seen.append, team) for _ in range(2)]
    alone = plan(view, asked, lambda _: None)
    answers = [
        encode(replace(a, trainings=tuple(replace(t, wall_s=0.0) for t in a.trainings)))
        for a in (alone, *together)
    ]
    assert [t.accepted for t in alone.trainings] == [False, True]
    assert answers[0] == answers[1] == answers[2]
    assert {p.attempt for p in seen} >= {0, 1}


def test_a_dead_worker_is_an_error_and_not_a_hang(rescue_view):
    with pytest.raises(ProcessDiedError, match="worker"):
        Team(rescue_view, 1, dead)
