"""Is something wrong? A residual test per vehicle and axis against the twin that is believed.

Two one-sided CUSUMs (Page 1954) on the normalised innovation. For white unit noise the mean time
between false alarms of one side comes from a Markov chain (Brook and Evans 1972); the threshold is
solved from the false-alarm rate asked for, shared out over all sides.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CHAIN_STATES = 80
DRIFT = 1.5  # sigma per sample; half of the smallest shift that is worth an alarm (3 sigma)


@dataclass(frozen=True)
class Cusum:
    """`statistic` is [V, 2 axes, 2 signs]; `quiet_since_s` [V] when a vehicle's were last all 0."""

    statistic: Array
    quiet_since_s: Array

    @property
    def level(self) -> Array:
        """[V, 2]: the larger of both sides."""
        return np.asarray(self.statistic.max(axis=2))


def start(vehicles: int, time_s: float) -> Cusum:
    return Cusum(np.zeros((vehicles, 2, 2)), np.full(vehicles, time_s))


def update(cusum: Cusum, residual: Array, time_s: float) -> Cusum:
    """One more normalised innovation [V, 2]; NaN rows (nothing received) leave their state."""
    z = np.nan_to_num(residual)
    known = ~np.isnan(residual)
    steps = np.stack([z - DRIFT, -z - DRIFT], axis=2)
    statistic = np.where(
        known[:, :, None], np.maximum(0.0, cusum.statistic + steps), cusum.statistic
    )
    quiet = statistic.reshape(len(statistic), -1).max(axis=1) == 0.0
    return Cusum(statistic, np.where(quiet, time_s, cusum.quiet_since_s))


def mean_time_to_false_alarm(threshold: float) -> float:
    """Samples between false alarms of one side, white unit noise (Brook and Evans 1972).

    The statistic is cut into CHAIN_STATES cells; with R the transitions that stay below the
    threshold, the mean run length from zero is the first entry of (I - R)^-1 1.
    """
    width = threshold / (CHAIN_STATES - 0.5)  # the first cell is half as wide: around zero
    middle = width * np.arange(CHAIN_STATES)
    upper = _normal_cdf(middle[None, :] + width / 2 - middle[:, None] + DRIFT)
    stay = np.diff(upper, axis=1, prepend=0.0)
    return float(np.linalg.solve(np.eye(CHAIN_STATES) - stay, np.ones(CHAIN_STATES))[0])


def _normal_cdf(x: Array) -> Array:
    return np.asarray(0.5 * np.vectorize(math.erfc)(-x / math.sqrt(2.0)))


@lru_cache
def threshold(false_alarms_per_hour: float, sample_hz: float, vehicles: int) -> float:
    """The CUSUM level whose alarms, of all vehicles, axes and signs together, are this rare."""
    sides = vehicles * 2 * 2
    wanted = sides * sample_hz * 3600.0 / false_alarms_per_hour
    low, high = 0.0, 20.0
    for _ in range(30):
        middle = (low + high) / 2
        if mean_time_to_false_alarm(middle) < wanted:
            low = middle
        else:
            high = middle
    return high
