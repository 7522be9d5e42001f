"""What is unknown under a hypothesis besides the fault itself, drawn and weighed.

K draws for each of T twins: motor gains, mass, rolling resistance, latency, the moment of onset,
and the size of the fault. Rows [R = K x T], the twins running fastest, so that all twins share the
draws as far as they can: what the draws do alike to all does not blur their comparison.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.belief.diagnosis import ReportFaults
from base_station.belief.hypotheses import SIZES, Hypothesis
from base_station.belief.watch import Baseline
from hil.faults import Type, Unit

Array = NDArray[np.float64]

DRAWS = 24  # K
SHRINKAGE = 0.95  # of resampled draws towards their mean, made up for by noise (Liu and West 2001)
JUMP_SIGMA_M = 3.0
SETTLING_S = (0.1, 0.8)  # of a vehicle's filter after a jump
DRIFT_SIGMA_MPS = 0.3


@dataclass(frozen=True, eq=False)
class Particles:
    """`share` [R] is where in its range an unknown size is; `parameters` has P = R."""

    twins: tuple[Hypothesis, ...]
    share: Array
    parameters: twin.Parameters
    motion: twin.FaultArrays
    reports: ReportFaults

    @property
    def sizes(self) -> Array:
        """[R] of faults whose size is drawn; NaN for the others."""
        return _sizes(self.twins, self.share)


def draw(baseline: Baseline, twins: Sequence[Hypothesis], rng: np.random.Generator) -> Particles:
    """From the priors: the parameters of the first draw are nominal."""
    parameters = twin.perturbed(baseline.model, rng, DRAWS)
    for nominal, draws in zip(baseline.model.nominal, parameters, strict=True):
        draws[0] = nominal[0]
    by_row = twin.Parameters(*(np.repeat(p, len(twins), axis=0) for p in parameters))
    return _with_sizes(baseline, tuple(twins), np.repeat(stratified(rng), len(twins)), by_row)


def stratified(rng: np.random.Generator) -> Array:
    """[K] one number from each K-th of (0, 1), in random order."""
    return (rng.permutation(DRAWS) + 0.5) / DRAWS


def resampled(
    particles: Particles, baseline: Baseline, log_likelihood: Array, rng: np.random.Generator
) -> tuple[Particles, NDArray[np.intp]]:
    """Draws by their weights within each twin, spread out a little again; and which rows they were.

    Systematic resampling with the shrunk kernels of Liu and West (2001).
    """
    count = len(particles.twins)
    weights = np.exp(log_likelihood - log_likelihood.max(axis=0)).reshape(DRAWS, count)
    weights /= weights.sum(axis=0)
    steps = (np.arange(DRAWS) + 0.5) / DRAWS
    chosen = np.stack([np.searchsorted(np.cumsum(w), steps - 1e-12) for w in weights.T], axis=1)
    rows = (np.minimum(chosen, DRAWS - 1) * count + np.arange(count)).ravel()
    parameters = twin.Parameters(*(_spread_out(p[rows], count, rng) for p in particles.parameters))
    share = np.clip(_spread_out(particles.share[rows], count, rng), 0.0, 1.0)
    return _with_sizes(baseline, particles.twins, share, parameters), rows


def _spread_out(values: Array, twins: int, rng: np.random.Generator) -> Array:
    """Rows [K x T, ...] shrunk towards the mean of their twin, and moved at random by as much."""
    by_twin = values.reshape(DRAWS, twins, *values.shape[1:])
    mean, sigma = by_twin.mean(axis=0), by_twin.std(axis=0)
    noise = sigma * rng.standard_normal((DRAWS, 1, *values.shape[1:]))  # alike for all twins
    moved = mean + SHRINKAGE * (by_twin - mean) + np.sqrt(1.0 - SHRINKAGE**2) * noise
    return np.asarray(np.maximum(moved, 0.0).reshape(values.shape))


def _with_sizes(
    baseline: Baseline, twins: tuple[Hypothesis, ...], share: Array, parameters: twin.Parameters
) -> Particles:
    sizes = _sizes(twins, share)
    rows = [h if np.isnan(s) else h.sized(s) for h, s in zip(twins * DRAWS, sizes, strict=True)]
    reports = report_faults(rows, share)
    return Particles(twins, share, parameters, baseline.faults(rows), reports)


def _sizes(twins: tuple[Hypothesis, ...], share: Array) -> Array:
    unsized = (np.nan, np.nan)
    ranges = [SIZES.get(h.kind, unsized) if h.kind else unsized for h in twins]
    low, high = np.array(ranges * DRAWS).T
    return np.asarray(low + share * (high - low))


def report_faults(rows: Sequence[Hypothesis], share: Array) -> ReportFaults:
    """What each of [R] does to the reports of its vehicle.

    How fast a vehicle's filter takes to a jump is unknown: `share` [R] of a range.
    """

    def where(kind: Type) -> list[bool]:
        return [h.kind == (Unit.GPS, kind) for h in rows]

    def size(kind: Type) -> list[float]:
        return [
            h.fault.size[0] if w and h.fault else 0.0
            for h, w in zip(rows, where(kind), strict=True)
        ]

    jump, (fast_s, slow_s) = np.array(where(Type.OFFSET)), SETTLING_S
    settling_s = fast_s + share * (slow_s - fast_s)
    drift_mps = np.where(where(Type.DRIFT), DRIFT_SIGMA_MPS, 0.0)
    return ReportFaults(
        drift_mps=np.where(jump, JUMP_SIGMA_M / settling_s, drift_mps),
        settling_s=np.where(jump, settling_s, np.inf),
        noise_m=np.array(size(Type.NOISE)),
        lag_s=np.array(size(Type.DELAY)),
    )
