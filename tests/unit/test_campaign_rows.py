"""How a run counts, and the numbers that rows add up to."""

import math

import pytest
from campaign_builders import healthy, row

from hil.bench.campaign.file import Campaign
from hil.bench.campaign.report import scores
from hil.bench.campaign.row import Row
from hil.bench.labels import CANNOT_TELL, NO_ALARM, WRONG_VEHICLE

UNTOLD = row(decided=False)
UNNOTICED = row(
    alarm_s=None, suspect=None, suspect_truth="none", hypothesis=None, decided=False, posterior={}
)
WRONG = row(hypothesis="gps_east_stuck", posterior={"gps_east_stuck": 1.0})
ELSEWHERE = row(suspect=1, suspect_truth="none", false_alarms=1, alarm_s=None)
CLEARED = healthy(suspect=1, hypothesis="none", decided=True, false_alarms=1, verdict_s=9.0)


@pytest.mark.parametrize(
    ("told", "said", "correct", "wrong"),
    [
        (row(), "motor_y_off", True, False),
        (healthy(), NO_ALARM, True, False),
        (CLEARED, "none", True, False),
        (UNTOLD, CANNOT_TELL, False, False),
        (UNNOTICED, NO_ALARM, False, False),
        (WRONG, "gps_east_stuck", False, True),
        (ELSEWHERE, WRONG_VEHICLE, False, True),
        (row(hypothesis="none"), "none", False, True),
        (row(truth="none", suspect_truth="none"), "motor_y_off", False, True),
    ],
)
def test_how_a_run_counts(told: Row, said: str, correct: bool, wrong: bool) -> None:
    assert (told.said, told.correct, told.wrong) == (said, correct, wrong)


def test_clearing_a_healthy_vehicle_does_not_find_the_broken_one() -> None:
    told = row(suspect=1, suspect_truth="none", hypothesis="none")
    assert not told.correct


def test_a_delay_is_that_of_faults_that_strike_under_way() -> None:
    assert row().delay_s == pytest.approx(1.5)
    assert row().judging_s == pytest.approx(10.0)
    assert row(onset_s=0.0).delay_s is None
    assert UNNOTICED.delay_s is None


def test_a_row_survives_its_journal() -> None:
    assert Row.of_tree(row().tree()) == row()


def test_the_confusion_matrix_counts_every_run_once() -> None:
    rows = [row(), row(), UNTOLD, WRONG, healthy(), CLEARED, UNNOTICED]
    truths, said, counts = scores.confusion(rows)
    assert counts.sum() == len(rows)
    cell = {(t, s): int(counts[i, j]) for i, t in enumerate(truths) for j, s in enumerate(said)}
    assert cell["motor_y_off", "motor_y_off"] == 2
    assert cell["motor_y_off", CANNOT_TELL] == 1
    assert cell["motor_y_off", NO_ALARM] == 1
    assert cell["none", NO_ALARM] == 1


def test_scores_of_a_class() -> None:
    (score,) = scores.class_scores([row(), row(), WRONG, UNTOLD])
    assert (score.runs, score.wrong) == (4, 1)
    assert score.decided.value == pytest.approx(3 / 4)
    assert score.right.value == pytest.approx(2 / 3)
    assert score.wrong_bound == pytest.approx(1 - 0.2486, abs=1e-3)  # P(X <= 1 | 4, p) = 5 %


def test_the_macro_average_does_not_mind_how_many_runs_a_class_has() -> None:
    rows = [row(layout=k) for k in range(30)] + [healthy(layout=k) for k in range(2)]
    rows += [healthy(layout=k, hypothesis="motor_y_off", decided=True) for k in (2, 3)]
    average = scores.macro(rows, lambda r: r.correct, scores.is_decided)
    assert average.value == pytest.approx((1.0 + 0.5) / 2)
    assert average.low < average.value < average.high


def test_false_alarms_count_over_the_time_of_healthy_vehicles() -> None:
    alarms, hours, rate = scores.false_alarms([healthy(healthy_vehicle_s=3600.0), CLEARED])
    assert alarms == 1
    assert hours == pytest.approx((3600 + 45) / 3600)
    assert rate.low < rate.value < rate.high


def test_forecasts_are_about_the_suspect() -> None:
    seen = scores.forecasts([row(), WRONG, healthy(), row(posterior={"gps_east_stuck": 0.4})])
    assert seen is not None
    assert len(seen.truth) == 3
    assert seen.right.tolist() == [True, False, False]
    assert seen.chances.sum(axis=1) == pytest.approx(1.0)
    assert scores.sure_errors(seen)[:2] == (2, 3)  # one posterior alone is all there was: sure
    looked = scores.forecasts([row(), healthy()], "2")
    assert looked is not None
    assert looked.confidence.tolist() == pytest.approx([0.7])
    assert scores.forecasts([healthy()]) is None


def test_undiagnosable_pairs_and_failures_are_scored_apart() -> None:
    campaign = Campaign.model_validate(
        {
            "name": "c",
            "scenario": "s",
            "grid": {"method": {"ours": {}, "ram": {}}},
            "headline": {"method": "ours"},
            "undiagnosable": [["gps_noise", "none_such"]],
        }
    )
    rows = [
        row(point={"method": "ours"}),
        row(point={"method": "ram"}),
        row(point={"method": "ours"}, truth="gps_noise"),
        row(point={"method": "ours"}, error="ValueError: x"),
    ]
    chosen = scores.choose(campaign, rows)
    assert [len(x) for x in (chosen.rows, chosen.apart, chosen.failed)] == [1, 1, 1]


def test_constant_guesses() -> None:
    guesses = scores.constant_guesses([row(), row(truth="motor_x_off"), row(), healthy()])
    assert guesses["always motor_y_off"].value == pytest.approx(0.5)
    assert guesses["oracle"].value == 1.0
    assert not math.isnan(guesses["oracle"].low)
