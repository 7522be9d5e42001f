"""How good is an experiment? The chance of confusing two hypotheses after it (pure, batched)."""

from dataclasses import dataclass
from itertools import combinations
from math import erfc, sqrt

import numpy as np
from numpy.typing import NDArray

from base_station.twin import (
    EAST,
    HELD_EAST,
    HELD_NORTH,
    NORTH,
    FaultArrays,
    FleetModel,
    Parameters,
    advance_in_place,
    perturbed,
    report,
)

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

REPORT_SIGMA_M = 0.05  # per axis and sample at the control rate
MODEL_ERROR = 0.15  # of the predicted displacement since the start
START_SIGMA_M = 0.03
DRAWS = 32
PERCENTILE = 0.9  # the error that this share of draws stays below
WALL_SHARE = 0.1  # a plan that touches a wall in more draws than this is invalid
INVALID = 1.0


@dataclass(frozen=True, eq=False)
class Prediction:
    """`reports` [N, H, K + 1, V, 2] (m) from the start on; `walls` [N]: did any twin touch one?"""

    reports: Array
    walls: Flags


def predict(
    model: FleetModel,
    parameters: Parameters,
    faults: FaultArrays,
    states: Array,
    setpoints: Array,
    driven: Flags,
    period_s: float,
) -> Prediction:
    """Play plans [N, K, V, 3] from states [N, H, V, S] under all hypotheses."""
    n, hypotheses = states.shape[:2]
    batch = states.reshape(-1, *states.shape[2:]).copy()
    walls = np.zeros(batch.shape[:2], dtype=np.bool_)
    flags = np.tile(driven, (len(batch), 1))
    no_impulses = np.empty((len(batch), 0, 0))
    reports = [report(batch, faults)]
    for k in range(setpoints.shape[1]):
        commanded = np.repeat(setpoints[:, k], hypotheses, axis=0)
        advance_in_place(
            model, parameters, faults, batch, commanded, flags, period_s, no_impulses, walls
        )
        reports.append(report(batch, faults))
    stacked = np.stack(reports, axis=1).reshape(n, hypotheses, len(reports), -1, 2)
    return Prediction(stacked, np.asarray(walls.reshape(n, -1).any(axis=1)))


def separation(reports: Array) -> Array:
    """d' of the worst pair of hypotheses, [N], for reports [N, H, K + 1, V, 2] from the start on.

    d'^2 is the sum over samples, vehicles and axes of (difference / sigma)^2, where sigma
    grows with the displacement that the pair predicts: what moves far is predicted less well.
    """
    if reports.shape[1] < 2:
        raise ValueError("an experiment needs two hypotheses at least")
    moved = np.linalg.norm(reports - reports[:, :, :1], axis=-1, keepdims=True)
    squares = pair_squares(reports[:, :, 1:], moved[:, :, 1:])
    worst: Array = np.sqrt(squares.min(axis=1))
    return worst


def pair_squares(reports: Array, moved_m: Array) -> Array:
    """d'^2 of every pair of hypotheses, [N, P], for reports [N, H, ..., 2] that have come
    `moved_m` [N, H, ..., 1] from where they were."""
    squares = []
    for a, b in combinations(range(reports.shape[1]), 2):
        sigma = REPORT_SIGMA_M + MODEL_ERROR * np.maximum(moved_m[:, a], moved_m[:, b])
        ratio = (reports[:, a] - reports[:, b]) / sigma
        squares.append((ratio**2).reshape(len(reports), -1).sum(axis=1))
    return np.stack(squares, axis=1)


def confusion(d_prime: Array) -> Array:
    """Q(d'/2): the error of choosing between two equally likely normal distributions d' apart."""
    errors: Array = 0.5 * np.vectorize(erfc, otypes=[np.float64])(d_prime / (2.0 * sqrt(2.0)))
    return errors


def plan_errors(
    model: FleetModel,
    faults: FaultArrays,
    start: Array,
    plans: Array,
    driven: Flags,
    period_s: float,
    rng: np.random.Generator,
    draws: int = DRAWS,
) -> Array:
    """The error that 90 % of draws stay below, [C], for plans [C, K, V, 3] from states [H, V, S].

    Draws are of the twin's uncertain parameters and of the start, the same for every plan.
    1.0 (INVALID) for plans that touch a wall too often.
    """
    count = len(plans)
    parameters = perturbed(model, rng, draws)
    states = np.repeat(start[None], draws, axis=0)
    noise = START_SIGMA_M * rng.standard_normal((draws, 1, model.size, 2))
    states[..., NORTH : EAST + 1] += noise
    states[..., HELD_NORTH : HELD_EAST + 1] += noise  # else it would be evidence by itself
    tiled = Parameters(*(np.tile(x, (count, *[1] * (x.ndim - 1))) for x in parameters))
    prediction = predict(
        model,
        tiled,
        faults,
        np.tile(states, (count, 1, 1, 1)),
        np.repeat(plans, draws, axis=0),
        driven,
        period_s,
    )
    errors = confusion(separation(prediction.reports)).reshape(count, draws)
    walls = prediction.walls.reshape(count, draws).mean(axis=1)
    return np.where(walls > WALL_SHARE, INVALID, np.quantile(errors, PERCENTILE, axis=1))
