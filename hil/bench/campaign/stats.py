"""The statistics of a campaign (pure): exact intervals, resampling by layout, scores."""

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.stats import beta, chi2

Array = NDArray[np.float64]
CONFIDENCE = 0.95
RESAMPLES = 1000
SMALLEST = 1e-6  # a posterior is told with six digits; none is taken to be surer than that


@dataclass(frozen=True)
class Estimate:
    """A value with its two-sided 95 % interval; NaN where there are no data."""

    value: float
    low: float
    high: float


def proportion(hits: int, trials: int, confidence: float = CONFIDENCE) -> Estimate:
    """Clopper and Pearson's exact interval (1934)."""
    if trials == 0:
        return Estimate(math.nan, 0.0, 1.0)
    tail = (1.0 - confidence) / 2.0
    low = 0.0 if hits == 0 else float(beta.ppf(tail, hits, trials - hits + 1))
    high = 1.0 if hits == trials else float(beta.ppf(1.0 - tail, hits + 1, trials - hits))
    return Estimate(hits / trials, low, high)


def upper_bound(hits: int, trials: int, confidence: float = CONFIDENCE) -> float:
    """One-sided upper bound of a proportion, Clopper and Pearson."""
    return proportion(hits, trials, 2.0 * confidence - 1.0).high


def rate(events: int, exposure: float, confidence: float = CONFIDENCE) -> Estimate:
    """Events per unit of exposure with the exact Poisson interval (Garwood 1936)."""
    if exposure <= 0.0:
        return Estimate(math.nan, 0.0, math.inf)
    tail = (1.0 - confidence) / 2.0
    low = float(chi2.ppf(tail, 2 * events)) / 2.0 if events else 0.0
    high = float(chi2.ppf(1.0 - tail, 2 * events + 2)) / 2.0
    return Estimate(events / exposure, low / exposure, high / exposure)


def by_cluster(
    statistic: Callable[[NDArray[np.intp]], float],
    clusters: Sequence[Hashable],
    resamples: int = RESAMPLES,
) -> Estimate:
    """`statistic` of row numbers, with a percentile interval from resampling whole clusters.

    Runs in one layout are not independent; layouts are (Field and Welsh 2007).
    """
    everything = np.arange(len(clusters))
    if not len(clusters):
        return Estimate(math.nan, math.nan, math.nan)
    value = statistic(everything)
    _, which = np.unique(np.array([str(c) for c in clusters]), return_inverse=True)
    members = [np.flatnonzero(which == k) for k in range(which.max() + 1)]
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(resamples):
        picked = rng.integers(len(members), size=len(members))
        drawn.append(statistic(np.concatenate([members[k] for k in picked])))
    tail = 100.0 * (1.0 - CONFIDENCE) / 2.0
    kept = np.array(drawn)[np.isfinite(drawn)]
    if not kept.size:
        return Estimate(value, math.nan, math.nan)
    low, high = np.percentile(kept, [tail, 100.0 - tail])
    return Estimate(value, float(low), float(high))


def risk_coverage(confidence: Array, wrong: Array) -> tuple[Array, Array]:
    """Coverage and risk among the surest, for every threshold between distinct confidences.

    `confidence` [N], `wrong` [N] is 0 or 1 (El-Yaniv and Wiener 2010). Equal ones come in together.
    """
    order = np.argsort(-confidence, kind="stable")
    taken = np.arange(1, len(order) + 1)
    last_of_ties = np.append(np.diff(confidence[order]) != 0.0, True)
    risk = np.cumsum(wrong[order]) / taken
    return (taken / len(order))[last_of_ties], risk[last_of_ties]


@dataclass(frozen=True)
class Bin:
    """Forecasts of about the same confidence, and how often they came true."""

    count: int
    confidence: float
    right: Estimate


def calibration(confidence: Array, right: NDArray[np.bool_], least: int = 100) -> list[Bin]:
    """Equal-mass bins of at least `least` forecasts each; one bin when there are fewer."""
    if not len(confidence):
        return []
    order = np.argsort(confidence, kind="stable")
    bins = np.array_split(order, max(1, len(order) // least))
    return [
        Bin(
            len(b),
            float(confidence[b].mean()),
            proportion(int(right[b].sum()), len(b)),
        )
        for b in bins
    ]


def log_losses(chances: Array, truth: NDArray[np.intp]) -> Array:
    """[N], nats: -ln of what was given to the truth, `chances` [N, K], `truth` [N]."""
    given = chances[np.arange(len(truth)), truth]
    return np.asarray(-np.log(np.clip(given, SMALLEST, 1.0)))


def brier(chances: Array, truth: NDArray[np.intp]) -> Array:
    """[N]: squared distance from certainty of the truth, over all classes (Brier 1950)."""
    sure = np.eye(chances.shape[1])[truth]
    return np.asarray(((chances - sure) ** 2).sum(axis=1))


def tempered(chances: Array, temperature: float) -> Array:
    """p^(1/T), normalised (Guo et al. 2017): above 1 less sure, below 1 surer."""
    logs = np.log(np.clip(chances, SMALLEST, 1.0)) / temperature
    powers = np.exp(logs - logs.max(axis=1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))


def fit_temperature(chances: Array, truth: NDArray[np.intp]) -> float:
    """The temperature of least log loss, 0.05 to 20."""

    def loss(log_temperature: float) -> float:
        return float(log_losses(tempered(chances, math.exp(log_temperature)), truth).mean())

    found = minimize_scalar(loss, bounds=(math.log(0.05), math.log(20.0)), method="bounded")
    return math.exp(float(found.x))
