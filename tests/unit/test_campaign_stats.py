"""Statistics against closed forms, and against data whose answer is known."""

import math

import numpy as np
import pytest

from hil.bench.campaign.stats import (
    brier,
    by_cluster,
    calibration,
    fit_temperature,
    log_losses,
    proportion,
    rate,
    risk_coverage,
    tempered,
    upper_bound,
)


@pytest.mark.parametrize("trials", [1, 22, 600])
def test_clopper_pearson_at_its_ends_has_a_closed_form(trials: int) -> None:
    none, every = proportion(0, trials), proportion(trials, trials)
    assert (none.value, none.low, every.value, every.high) == (0.0, 0.0, 1.0, 1.0)
    assert none.high == pytest.approx(1.0 - 0.025 ** (1.0 / trials))
    assert every.low == pytest.approx(0.025 ** (1.0 / trials))
    assert upper_bound(0, trials) == pytest.approx(1.0 - 0.05 ** (1.0 / trials))


def test_nine_errors_of_600_are_at_most_2_6_percent() -> None:
    """The bound solves P(X <= 9 | p) = 5 %."""
    p = upper_bound(9, 600)
    tail = sum(math.comb(600, k) * p**k * (1.0 - p) ** (600 - k) for k in range(10))
    assert tail == pytest.approx(0.05)
    assert p == pytest.approx(0.026, abs=0.0005)


def test_a_poisson_rate_without_events_is_below_the_rule_of_three() -> None:
    quiet = rate(0, 100.0)
    assert (quiet.value, quiet.low) == (0.0, 0.0)
    assert quiet.high == pytest.approx(-math.log(0.025) / 100.0)
    some = rate(4, 100.0)
    above = sum(
        math.exp(-100 * some.high) * (100 * some.high) ** k / math.factorial(k) for k in range(5)
    )
    assert above == pytest.approx(0.025)


def test_no_data_is_no_value() -> None:
    assert math.isnan(proportion(0, 0).value)
    assert math.isnan(rate(0, 0.0).value)
    assert math.isnan(by_cluster(lambda k: float(len(k)), []).value)


def test_resampling_by_layout_sees_that_a_layout_repeats_itself() -> None:
    """Twenty copies of each of 30 values are 30 values: the interval is that of 30, not of 600."""
    values = np.random.default_rng(1).normal(size=30)
    copies, layouts = np.repeat(values, 20), np.repeat(np.arange(30), 20).tolist()
    clustered = by_cluster(lambda k: float(copies[k].mean()), layouts)
    naive = by_cluster(lambda k: float(copies[k].mean()), list(range(600)))
    width, expected = clustered.high - clustered.low, 2 * 1.96 * float(values.std()) / 30**0.5
    assert width == pytest.approx(expected, rel=0.15)
    assert width > 3 * (naive.high - naive.low)


def test_risk_and_coverage_of_five_runs() -> None:
    confidence, wrong = np.array([0.9, 0.5, 0.8, 0.9, 0.6]), np.array([0.0, 1.0, 1.0, 0.0, 0.0])
    coverage, risk = risk_coverage(confidence, wrong)
    assert coverage.tolist() == pytest.approx([0.4, 0.6, 0.8, 1.0])  # the two of 0.9 together
    assert risk.tolist() == pytest.approx([0.0, 1 / 3, 1 / 4, 2 / 5])


def test_bins_have_equal_mass_and_at_least_a_hundred() -> None:
    rng = np.random.default_rng(2)
    confidence = rng.uniform(0.5, 1.0, 1050)
    bins = calibration(confidence, rng.uniform(size=1050) < confidence)
    assert sum(b.count for b in bins) == 1050
    assert {b.count for b in bins} == {105}
    assert [b.confidence for b in bins] == sorted(b.confidence for b in bins)
    assert sum(b.right.low <= b.confidence <= b.right.high for b in bins) >= 9
    assert [b.count for b in calibration(confidence[:30], confidence[:30] > 0.0)] == [30]


def test_scores_of_a_forecast_in_closed_form() -> None:
    chances, truth = np.array([[0.7, 0.2, 0.1], [0.0, 0.0, 1.0]]), np.array([0, 2])
    assert log_losses(chances, truth).tolist() == pytest.approx([-math.log(0.7), 0.0])
    assert brier(chances, truth).tolist() == pytest.approx([0.09 + 0.04 + 0.01, 0.0])
    assert log_losses(chances, np.array([0, 0]))[1] == pytest.approx(-math.log(1e-6))  # not inf


def test_a_temperature_undoes_overconfidence() -> None:
    """Outcomes drawn from q; forecasts are q^3: the temperature that mends them is 3."""
    rng = np.random.default_rng(3)
    honest = rng.dirichlet([1.0, 1.0, 1.0], 4000) * 0.9 + 0.1 / 3
    truth = np.array([rng.choice(3, p=q) for q in honest])
    assert fit_temperature(tempered(honest, 1.0 / 3.0), truth) == pytest.approx(3.0, rel=0.1)
    assert tempered(honest, 1.0) == pytest.approx(honest)
