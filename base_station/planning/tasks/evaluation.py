"""How good is an experiment? The chance of confusing two hypotheses after it (pure, batched)."""

from dataclasses import dataclass
from itertools import combinations
from math import erfc, sqrt
from typing import Self

import numpy as np
from numpy.typing import NDArray

from base_station.planning.tasks.limits import Contacts, Limits
from base_station.planning.tasks.motion import move
from base_station.twin import (
    EAST,
    HELD_EAST,
    HELD_NORTH,
    NORTH,
    V_EAST,
    V_NORTH,
    FaultArrays,
    FleetModel,
    Parameters,
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
    """`reports` [N, H, K + 1, V, 2] (m) from the start on; `walls` [N]: did any twin touch one that
    it may not? `breaches` [N]: was any limit broken? `contacts` of N x H rows, if asked for;
    `work_j` [N, H] against rolling resistance."""

    reports: Array
    walls: Flags
    breaches: Flags
    contacts: Contacts
    work_j: Array


def predict(
    model: FleetModel,
    parameters: Parameters,
    faults: FaultArrays,
    states: Array,
    setpoints: Array,
    driven: Flags,
    period_s: float,
    limits: Limits,
    contacts_too: bool = False,
) -> Prediction:
    """Play plans [N, K, V, 3] from states [N, H, V, S] under all hypotheses."""
    n, hypotheses = states.shape[:2]
    batch = states.reshape(-1, *states.shape[2:]).copy()
    walls = np.zeros(batch.shape[:2], dtype=np.bool_)
    flags = np.tile(driven, (len(batch), 1))
    impulses, speeds = contacts_too or limits.of_contacts, contacts_too or limits.of_speed
    whole = Contacts.none(len(batch), model.size, impulses, speeds)
    broken, work_j = np.zeros(len(batch)), np.zeros(len(batch))
    reports = [report(batch, faults)]
    for k in range(setpoints.shape[1]):
        commanded = np.repeat(setpoints[:, k], hypotheses, axis=0)
        met = Contacts.none(len(batch), model.size, impulses, speeds)
        move(model, parameters, faults, batch, commanded, flags, period_s, walls, met)
        whole.add(met)
        broken += limits.breaches(met, batch, model)
        work_j += rolling_work_j(model, batch, period_s)
        reports.append(report(batch, faults))
    stacked = np.stack(reports, axis=1).reshape(n, hypotheses, len(reports), -1, 2)
    return Prediction(
        stacked,
        np.asarray((walls & ~limits.may_brush).reshape(n, -1).any(axis=1)),
        np.asarray(broken.reshape(n, -1).any(axis=1)),
        whole,
        work_j.reshape(n, hypotheses),
    )


def rolling_work_j(model: FleetModel, states: Array, period_s: float) -> Array:
    """What rolling resistance takes in a period at the speeds of states [..., V, S]: [...]."""
    speed = np.linalg.norm(states[..., V_NORTH : V_EAST + 1], axis=-1)
    work: Array = (speed * model.nominal.rolling_force_n[0]).sum(axis=-1) * period_s
    return work


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


@dataclass(frozen=True, eq=False)
class Draws:
    """`count` fleets as they may be: parameters (P = count) and starts [count, H, V, S]."""

    parameters: Parameters
    starts: Array

    @classmethod
    def of(cls, model: FleetModel, start: Array, rng: np.random.Generator, count: int) -> Self:
        """Draws of the twin's uncertain parameters and of where states [H, V, S] really are."""
        parameters = perturbed(model, rng, count)
        states = np.repeat(start[None], count, axis=0)
        noise = START_SIGMA_M * rng.standard_normal((count, 1, model.size, 2))
        states[..., NORTH : EAST + 1] += noise
        states[..., HELD_NORTH : HELD_EAST + 1] += noise  # else it would be evidence by itself
        return cls(parameters, states)


def plan_errors(
    model: FleetModel,
    faults: FaultArrays,
    start: Array,
    plans: Array,
    driven: Flags,
    period_s: float,
    limits: Limits,
    rng: np.random.Generator,
    draws: int = DRAWS,
) -> Array:
    """The error that 90 % of draws stay below, [C], for plans [C, K, V, 3] from states [H, V, S].

    The draws are the same for every plan. 1.0 (INVALID) for plans that touch a wall too often, or
    break a limit in any draw.
    """
    count, drawn = len(plans), Draws.of(model, start, rng, draws)
    tiled = (np.tile(x, (count, *[1] * (x.ndim - 1))) for x in drawn.parameters)
    prediction = predict(
        model,
        Parameters(*tiled),
        faults,
        np.tile(drawn.starts, (count, 1, 1, 1)),
        np.repeat(plans, draws, axis=0),
        driven,
        period_s,
        limits,
    )
    errors = confusion(separation(prediction.reports)).reshape(count, draws)
    walls = prediction.walls.reshape(count, draws).mean(axis=1) > WALL_SHARE
    breaches = prediction.breaches.reshape(count, draws).any(axis=1)
    return np.where(walls | breaches, INVALID, np.quantile(errors, PERCENTILE, axis=1))
