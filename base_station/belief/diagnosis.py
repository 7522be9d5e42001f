"""Predicted against observed: log-likelihoods, posterior, verdict (pure).

A row is one twin with one draw of what is unknown about it. Per row and axis a Kalman filter
follows how far reports are off the twin's prediction, and how fast that changes; what is left, the
innovation, is white under the true hypothesis, so that an error made once is not counted at every
sample. A drift of the GPS is a prior on that state, so its size need not be searched; a jump is one
that dies away, because the vehicle's own filter takes to it over a second or so.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from base_station.belief.hypotheses import Hypothesis

Array = NDArray[np.float64]

NOISE_SIGMA_M = 0.03  # of one report after the vehicle's filter
OFFSET_SIGMA_M = 0.05  # of the constant difference between a report and a twin's, at first
WANDER_SIGMA_M = 0.005  # of that difference from one sample to the next: GPS wander, latency
MODEL_ERROR = 0.10  # of the motion a twin expects, beyond what its parameters explain
TAIL_DOF = 4.0  # Student's t: one bad sample must not decide
UNKNOWN_SIGMA_M = 0.5  # 'something else': the next report is within half a metre of the last
SAMPLE_PERIOD_S = 0.3  # about what the vehicle's filter remembers


class ReportFaults(NamedTuple):
    """What is wrong with the reports of the suspect, for rows [R]; all zero: nothing."""

    drift_mps: Array  # sigma of a drift from the onset on
    settling_s: Array  # time constant with which it dies away: a jump; infinite: steady
    noise_m: Array  # sigma of additional noise
    lag_s: Array  # additional age


@dataclass(frozen=True)
class Verdict:
    """What the station concludes. `posterior` has every candidate by name and sums to 1."""

    sysid: int
    hypothesis: str
    posterior: dict[str, float]
    decided: bool


@dataclass(frozen=True, eq=False)
class Fit:
    """How well rows [R] have explained one vehicle's reports so far, per axis (north, east)."""

    offset_m: Array  # [R, 2]
    drift_mps: Array  # [R, 2]
    variance_m2: Array  # [R, 2] of the offset
    covariance: Array  # [R, 2] of offset and drift, m2/s
    drift_variance: Array  # [R, 2] m2/s2
    path_m: Array  # [R, 2] motion expected since the last sample
    log_likelihood: Array  # [R]


def fresh_fit(rows: int) -> Fit:
    zero = np.zeros((rows, 2))
    variance_m2 = np.full((rows, 2), OFFSET_SIGMA_M**2)
    return Fit(zero, zero, variance_m2, zero, zero, zero, np.zeros(rows))


def struck(fit: Fit, faults: ReportFaults, rows: NDArray[np.bool_]) -> Fit:
    """The GPS faults of `rows` [R] begin: a drift of unknown size."""
    drift = np.where(rows, faults.drift_mps, 0.0)[:, None] ** 2
    return replace(fit, drift_variance=fit.drift_variance + drift)


def carried_over(fit: Fit, rows: NDArray[np.intp], off: NDArray[np.bool_]) -> Fit:
    """For twins set to their reports: afresh, but where reports are `off` [R] for good."""
    new, two = fresh_fit(len(rows)), off[:, None]
    return Fit(
        offset_m=np.where(two, fit.offset_m[rows], new.offset_m),
        drift_mps=np.where(two, fit.drift_mps[rows], new.drift_mps),
        variance_m2=np.where(two, fit.variance_m2[rows], new.variance_m2),
        covariance=np.where(two, fit.covariance[rows], new.covariance),
        drift_variance=np.where(two, fit.drift_variance[rows], new.drift_variance),
        path_m=new.path_m,
        log_likelihood=new.log_likelihood,
    )


def expected(fit: Fit, settling_s: Array, period_s: float) -> Fit:
    """The offset one sample later, before its report is looked at; `settling_s` [R]."""
    steady = np.isinf(settling_s)
    tau_s = np.where(steady, 1.0, settling_s)
    keep = np.where(steady, 1.0, np.exp(-period_s / tau_s))[:, None]
    reach_s = np.where(steady[:, None], period_s, tau_s[:, None] * (1.0 - keep))
    wander = WANDER_SIGMA_M**2 + (MODEL_ERROR * fit.path_m) ** 2
    grown = 2.0 * reach_s * fit.covariance + reach_s**2 * fit.drift_variance
    return replace(
        fit,
        offset_m=fit.offset_m + reach_s * fit.drift_mps,
        drift_mps=keep * fit.drift_mps,
        variance_m2=fit.variance_m2 + grown + wander,
        covariance=keep * (fit.covariance + reach_s * fit.drift_variance),
        drift_variance=keep**2 * fit.drift_variance,
        path_m=np.zeros_like(fit.path_m),
    )


def sigma_m(fit: Fit, noise_m: Array) -> Array:
    """[R, 2]: spread of a report around its prediction; `noise_m` [R] beyond the usual."""
    return np.sqrt(fit.variance_m2 + NOISE_SIGMA_M**2 + noise_m[:, None] ** 2)


def judge(
    fit: Fit, observed_m: Array, predicted_m: Array, faults: ReportFaults, period_s: float
) -> Fit:
    """Take in one report [2] against predictions [R, 2]: Student's t on the innovations."""
    fit = expected(fit, faults.settling_s, period_s)
    sigma = sigma_m(fit, faults.noise_m)
    innovation = observed_m - predicted_m - fit.offset_m
    z2 = (innovation / sigma) ** 2
    per_axis = _LOG_NORM - np.log(sigma) - (TAIL_DOF + 1) / 2 * np.log1p(z2 / TAIL_DOF)
    gain, drift_gain = fit.variance_m2 / sigma**2, fit.covariance / sigma**2
    return Fit(
        offset_m=fit.offset_m + gain * innovation,
        drift_mps=fit.drift_mps + drift_gain * innovation,
        variance_m2=(1.0 - gain) * fit.variance_m2,
        covariance=(1.0 - gain) * fit.covariance,
        drift_variance=fit.drift_variance - drift_gain * fit.covariance,
        path_m=fit.path_m,
        log_likelihood=fit.log_likelihood + per_axis.sum(axis=1),
    )


_LOG_NORM = (
    math.lgamma((TAIL_DOF + 1) / 2) - math.lgamma(TAIL_DOF / 2) - 0.5 * math.log(TAIL_DOF * math.pi)
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
