"""Predicted against observed: log-likelihoods, posterior, verdict (pure)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.hypotheses import Hypothesis

Array = NDArray[np.float64]

REPORT_SIGMA_M = 0.03  # declared noise after the vehicle's filter, wander and time alignment
MODEL_ERROR = 0.15  # of the displacement the twin predicts: gains, rolling resistance, contact
TAIL_DOF = 4.0  # Student's t: one bad sample must not decide
UNKNOWN_SIGMA_M = 0.5  # 'something else': the next report is within half a metre of the last
SAMPLE_PERIOD_S = 0.3  # about what the vehicle's filter remembers
TEMPER = 0.5  # successive residuals share the twin's error: count each as half a sample


@dataclass(frozen=True)
class Verdict:
    """What the station concludes. `posterior` has every candidate by name and sums to 1."""

    sysid: int
    hypothesis: str
    posterior: dict[str, float]
    decided: bool


def report_sigma_m(moved_m: Array) -> Array:
    """One standard deviation (m) of a report predicted after `moved_m` of predicted motion."""
    return np.hypot(REPORT_SIGMA_M, MODEL_ERROR * np.abs(moved_m))


def twin_log_likelihood(observed_m: Array, predicted_m: Array, moved_m: Array) -> Array:
    """[H] log-likelihood of one report [2] under twins' predictions [H, 2] (Student's t)."""
    sigma = report_sigma_m(moved_m)
    z2 = ((observed_m - predicted_m) / sigma) ** 2
    log_norm = (
        math.lgamma((TAIL_DOF + 1) / 2)
        - math.lgamma(TAIL_DOF / 2)
        - 0.5 * math.log(TAIL_DOF * math.pi)
    )
    per_axis = log_norm - np.log(sigma) - (TAIL_DOF + 1) / 2 * np.log1p(z2 / TAIL_DOF)
    return np.asarray(TEMPER * per_axis.sum(axis=-1))


def unknown_log_likelihood(observed_m: Array, previous_m: Array) -> float:
    """Of one report under 'something else': anywhere near the one before."""
    z2 = ((observed_m - previous_m) / UNKNOWN_SIGMA_M) ** 2
    per_axis = -0.5 * math.log(2 * math.pi) - math.log(UNKNOWN_SIGMA_M) - 0.5 * z2
    return float(TEMPER * per_axis.sum())


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
