"""The predicted error of an experiment against closed forms."""

import math

import numpy as np
import pytest

from base_station.belief.hypotheses import candidates
from base_station.planning.tasks.evaluation import (
    INVALID,
    MODEL_ERROR,
    REPORT_SIGMA_M,
    confusion,
    plan_errors,
    separation,
)
from base_station.planning.tasks.limits import Limits
from base_station.twin import EAST, FleetModel, fault_rows, initial_state

ANYTHING = Limits(np.inf, np.inf, np.ones((3, 3), dtype=np.bool_), 0.0, np.zeros(3, np.bool_))


def two_reports(moved_m: float, samples: int) -> np.ndarray:
    """One vehicle; under the second hypothesis it is moved east, under the first it stays."""
    reports = np.zeros((1, 2, samples + 1, 1, 2))
    reports[0, 1, 1:, 0, 1] = moved_m
    return reports


def test_confusion_of_what_is_the_same_is_a_coin_toss():
    assert confusion(np.array([0.0, 2 * 2.326348])) == pytest.approx([0.5, 0.01], abs=1e-6)


@pytest.mark.parametrize("samples", [1, 9])
def test_separation_is_the_difference_in_declared_sigmas(samples):
    sigma = REPORT_SIGMA_M + MODEL_ERROR * 0.4
    expected = 0.4 / sigma * math.sqrt(samples)
    assert separation(two_reports(0.4, samples)) == pytest.approx([expected])


def test_a_push_far_away_never_counts_for_more_than_the_model_is_worth():
    assert separation(two_reports(1e6, 1)) == pytest.approx([1.0 / MODEL_ERROR], rel=1e-3)


def test_the_worst_pair_counts():
    reports = np.concatenate([two_reports(1.0, 4), two_reports(0.05, 4)[:, 1:]], axis=1)
    assert separation(reports) == pytest.approx(separation(two_reports(0.05, 4)))


def test_one_hypothesis_needs_no_experiment():
    with pytest.raises(ValueError, match="two hypotheses"):
        separation(two_reports(1.0, 1)[:, :1])


def scripted(view, east_mps: float, seconds: float, held_after: float = 0.0) -> np.ndarray:
    """Rover 1, west of the suspect, drives east for a while: one plan [1, K, V, 3]."""
    plan = np.zeros((1, 16, 3, 3))
    plan[..., 2] = np.nan
    plan[0, : round(seconds * view.clock.control_hz), 0, 1] = east_mps
    plan[0, round(seconds * view.clock.control_hz) :, 0, 1] = held_after
    return plan


@pytest.fixture
def scene(rescue_view):
    model = FleetModel.from_view(rescue_view)
    known = {h.name: h for h in candidates(rescue_view.fleet[1], rescue_view.diagnosis.priors)}
    faults = fault_rows(model, [known["motor_y_off"], known["gps_east_stuck"]])
    start = initial_state([[0.0, -2.5], [0.0, 0.0], [0.0, 2.5]], [0.0] * 3)
    return model, faults, np.stack([start, start]), np.array([True, False, True])


def errors_of(scene, plan):
    model, faults, start, driven = scene
    return plan_errors(model, faults, start, plan, driven, 0.5, ANYTHING, np.random.default_rng(0))


def test_a_push_decides_and_standing_by_does_not(scene, rescue_view):
    push, wait = scripted(rescue_view, 1.0, 4.0), scripted(rescue_view, 0.0, 4.0)
    errors = errors_of(scene, np.concatenate([push, wait]))
    assert errors[0] < 1e-6
    assert errors[1] == 0.5


def test_commanding_the_suspect_itself_does_not_decide(scene, rescue_view):
    model, faults, start, _ = scene
    plan = scripted(rescue_view, 0.0, 0.0)
    plan[0, :4, 1, 1] = 0.5
    driven = np.array([True, True, True])
    rng = np.random.default_rng(0)
    assert plan_errors(model, faults, start, plan, driven, 0.5, ANYTHING, rng).tolist() == [0.5]


def test_a_plan_into_the_wall_is_invalid(scene, rescue_view):
    plan = scripted(rescue_view, 1.0, 4.0, held_after=-1.0)
    plan[0, :, 2, 1] = 1.0  # rover 3 drives into the eastern wall meanwhile
    assert errors_of(scene, plan).tolist() == [INVALID]


def test_a_narrow_miss_counts_by_its_worst_draws(scene, rescue_view):
    """A plan that ends as it touches is good in some draws only: the percentile shows it."""
    plans = np.concatenate([scripted(rescue_view, 1.0, s) for s in (1.5, 2.0, 4.0)])
    errors = errors_of(scene, plans)
    assert errors[0] == 0.5
    assert errors[0] >= errors[1] > errors[2]


def test_a_shift_between_the_twins_is_no_evidence_by_itself(scene, rescue_view):
    _, _, start, _ = scene
    start[1, 1, EAST] += 0.15
    assert errors_of(scene, scripted(rescue_view, 0.0, 0.0)).tolist() == [0.5]
