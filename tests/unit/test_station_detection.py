"""The residual test: its stated false-alarm rate, and that it sees what it must see."""

import numpy as np
import pytest

from base_station.belief import detection


def _first_alarm(residuals: np.ndarray, threshold: float) -> int | None:
    cusum = detection.start(1, 0.0)
    for k, residual in enumerate(residuals):
        cusum = detection.update(cusum, residual[None], 0.1 * k)
        if cusum.level.max() > threshold:
            return k
    return None


def test_white_noise_alarms_as_rarely_as_the_closed_form_says() -> None:
    rng = np.random.default_rng(1)
    threshold = 2.0
    expected = detection.mean_time_to_false_alarm(threshold) / 4  # two axes, two signs
    alarms, samples = 0, 60_000
    cusum = detection.start(1, 0.0)
    for residual in rng.standard_normal((samples, 1, 2)):
        cusum = detection.update(cusum, residual, 0.0)
        if cusum.level.max() > threshold:
            alarms += 1
            cusum = detection.start(1, 0.0)
    assert samples / alarms == pytest.approx(expected, rel=0.15)


def test_the_threshold_grows_with_rarer_alarms_and_more_vehicles() -> None:
    few = detection.threshold(1.0, 10.0, 3)
    assert detection.threshold(0.1, 10.0, 3) > few
    assert detection.threshold(1.0, 10.0, 30) > few


def test_a_shift_of_three_sigma_is_seen_within_a_second() -> None:
    rng = np.random.default_rng(2)
    residuals = rng.standard_normal((50, 2)) + np.array([0.0, 3.0])
    alarm = _first_alarm(residuals, detection.threshold(0.1, 10.0, 3))
    assert alarm is not None
    assert alarm <= 10


def test_missing_samples_change_nothing() -> None:
    cusum = detection.update(detection.start(2, 0.0), np.array([[3.0, 0.0], [0.0, 0.0]]), 0.1)
    after = detection.update(cusum, np.full((2, 2), np.nan), 0.2)
    assert np.array_equal(after.statistic, cusum.statistic)


def test_it_remembers_when_a_vehicle_was_last_quiet() -> None:
    cusum = detection.start(2, 0.0)
    for k in range(1, 6):
        cusum = detection.update(cusum, np.array([[5.0, 0.0], [0.0, 0.0]]), 0.1 * k)
    assert cusum.quiet_since_s[0] == 0.0
    assert cusum.quiet_since_s[1] == pytest.approx(0.5)
