"""Predicted against observed: log-likelihoods, posterior, verdict (pure)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.hypotheses import Hypothesis

Array = NDArray[np.float64]

NOISE_SIGMA_M = 0.03  # of one report after the vehicle's filter
OFFSET_SIGMA_M = 0.05  # of the constant difference between a report and a twin's, at first
WANDER_SIGMA_M = 0.005  # of that difference from one sample to the next: GPS wander, latency
MODEL_ERROR = 0.15  # of the motion a twin expects: gains, rolling resistance, contact
TAIL_DOF = 4.0  # Student's t: one bad sample must not decide
UNKNOWN_SIGMA_M = 0.5  # 'something else': the next report is within half a metre of the last
SAMPLE_PERIOD_S = 0.3  # about what the vehicle's filter remembers


@dataclass(frozen=True)
class Verdict:
    """What the station concludes. `posterior` has every candidate by name and sums to 1."""

    sysid: int
    hypothesis: str
    posterior: dict[str, float]
    decided: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """How well twins [T] have explained one vehicle's reports so far, per axis (north, east).

    A scalar Kalman filter per twin and axis follows the slowly varying offset between reports and
    predictions, which grows uncertain as the twin expects motion. What is left, the innovation, is
    white under the true hypothesis, so that an error made once is not counted at every sample.
    """

    offset_m: Array  # [T, 2]
    variance_m2: Array  # [T, 2]
    path_m: Array  # [T, 2] motion expected since the last sample
    log_likelihood: Array  # [T]

    @property
    def sigma_m(self) -> Array:
        """[T, 2]: spread of the next report around its prediction."""
        return np.sqrt(self._predicted_variance() + NOISE_SIGMA_M**2)

    def _predicted_variance(self) -> Array:
        return self.variance_m2 + WANDER_SIGMA_M**2 + (MODEL_ERROR * self.path_m) ** 2


def fresh_fit(twins: int) -> Fit:
    shape = (twins, 2)
    return Fit(np.zeros(shape), np.full(shape, OFFSET_SIGMA_M**2), np.zeros(shape), np.zeros(twins))


def judge(fit: Fit, observed_m: Array, predicted_m: Array) -> Fit:
    """Take in one report [2] against predictions [T, 2]: Student's t on the innovations."""
    sigma = fit.sigma_m
    innovation = observed_m - predicted_m - fit.offset_m
    log_norm = (
        math.lgamma((TAIL_DOF + 1) / 2)
        - math.lgamma(TAIL_DOF / 2)
        - 0.5 * math.log(TAIL_DOF * math.pi)
    )
    z2 = (innovation / sigma) ** 2
    per_axis = log_norm - np.log(sigma) - (TAIL_DOF + 1) / 2 * np.log1p(z2 / TAIL_DOF)
    gain = 1.0 - NOISE_SIGMA_M**2 / sigma**2
    return Fit(
        offset_m=fit.offset_m + gain * innovation,
        variance_m2=gain * NOISE_SIGMA_M**2,
        path_m=np.zeros_like(fit.path_m),
        log_likelihood=fit.log_likelihood + per_axis.sum(axis=1),
    )


def unknown_log_likelihood(observed_m: Array, previous_m: Array) -> float:
    """Of one report under 'something else': anywhere near the one before."""
    z2 = ((observed_m - previous_m) / UNKNOWN_SIGMA_M) ** 2
    per_axis = -0.5 * math.log(2 * math.pi) - math.log(UNKNOWN_SIGMA_M) - 0.5 * z2
    return float(per_axis.sum())


def posterior(log_weights: Array) -> Array:
    """Normalised probabilities of log weights [H]."""
    shifted = np.exp(log_weights - log_weights.max())
    return np.asarray(shifted / shifted.sum())


def decide(hypotheses: tuple[Hypothesis, ...], weights: Array, decide_at: float) -> Verdict:
    """The most probable explanation, decided when its posterior reaches `decide_at`."""
    p = posterior(weights)
    best = int(p.argmax())
    return Verdict(
        sysid=hypotheses[best].sysid,
        hypothesis=hypotheses[best].name,
        posterior={h.name: round(float(x), 6) for h, x in zip(hypotheses, p, strict=True)},
        decided=bool(p[best] >= decide_at),
    )
