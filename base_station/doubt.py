"""A suspect under doubt: one twin per hypothesis, each carrying its own state and its evidence.

While a vehicle is in doubt its twins are driven by the orders sent and by the neighbours as they
are seen, and never drawn towards the suspect's own reports: those are what is being judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station import diagnosis, twin
from base_station.diagnosis import Fit, Verdict
from base_station.execution import Orders
from base_station.hypotheses import Hypothesis
from base_station.telemetry import Frame
from base_station.watch import CORRECTION_TIME_S, Baseline, correct

Array = NDArray[np.float64]

FLOOR = 1e-3  # 'something else' is never ruled out before an experiment


@dataclass(frozen=True, eq=False)
class Doubt:
    """`prior` [H] are log weights before `fit` and `unknown` began; T of the H have a twin, first.

    `states` [T, V, S]; `last_report_m` [2] is the report judged last, at `judged_s`.
    """

    baseline: Baseline
    suspect: int
    hypotheses: tuple[Hypothesis, ...]
    prior: Array
    states: Array
    fit: Fit
    unknown: float
    last_report_m: Array
    judged_s: float

    @property
    def twins(self) -> tuple[Hypothesis, ...]:
        return tuple(h for h in self.hypotheses if h.has_twin)

    @property
    def faults(self) -> twin.FaultArrays:
        return self.baseline.faults(self.twins)

    @property
    def log_weights(self) -> Array:
        """[H], not normalised."""
        beyond = [self.unknown] * (len(self.hypotheses) - len(self.twins))
        return np.asarray(self.prior + np.array([*self.fit.log_likelihood, *beyond]))

    @property
    def posterior(self) -> Array:
        """[H], sums to 1."""
        return diagnosis.posterior(self.log_weights)

    @property
    def report_m(self) -> Array:
        """[T, V, 2]: what each twin expects to receive."""
        return np.asarray(twin.report(self.states, self.faults))

    @property
    def sigma_m(self) -> Array:
        """[T, 2]: spread of what each twin expects of the suspect."""
        return self.fit.sigma_m

    def verdict(self, decide_at: float) -> Verdict:
        return diagnosis.decide(self.hypotheses, self.log_weights, decide_at)


def tick(doubt: Doubt, frame: Frame, orders: Orders, period_s: float) -> Doubt:
    """Move every twin on by one telemetry period, and judge the suspect's report when it is due."""
    return advanced(doubt, doubt.faults, frame, orders, period_s)


def anchor(doubt: Doubt, report_m: Array) -> Doubt:
    """Start afresh from a fleet at rest in HOLD whose mean reports are `report_m` [V, 2].

    Every twin takes over what its hypothesis trusts; on a stuck axis the report only says where
    it is stuck, and the vehicle stays where this twin has reckoned it to be.
    """
    states = doubt.states.copy()
    stuck = doubt.faults.gps_stuck > 0.5
    position = states[..., twin.NORTH : twin.EAST + 1]
    held = states[..., twin.HELD_NORTH : twin.HELD_EAST + 1]
    position[...] = np.where(stuck, position, report_m)
    held[...] = np.where(stuck, report_m, held)
    for column in (twin.V_NORTH, twin.V_EAST, twin.YAW_RATE, twin.I_X, twin.I_Y):
        states[..., column] = 0.0
    return replace(
        doubt,
        prior=np.log(doubt.posterior + 1e-300),
        states=states,
        fit=diagnosis.fresh_fit(len(doubt.twins)),
        unknown=0.0,
        last_report_m=report_m[doubt.suspect],
    )


def awake(doubt: Doubt) -> Doubt:
    """Lift 'something else' to FLOOR: a fleet at rest suits every twin better than no twin."""
    floor = np.array([0.0 if h.has_twin else FLOOR for h in doubt.hypotheses])
    weights = np.log(np.maximum(doubt.posterior, floor) + 1e-300)
    return replace(doubt, prior=weights + doubt.prior - doubt.log_weights)


def narrowed(doubt: Doubt, keep: Sequence[int]) -> tuple[tuple[Hypothesis, ...], Array, Array]:
    """The twins `keep` (indices): hypotheses, renormalised posterior [K] and states [K, V, S]."""
    p = doubt.posterior[list(keep)]
    return tuple(doubt.twins[k] for k in keep), p / p.sum(), doubt.states[list(keep)]


def advanced(
    doubt: Doubt, faults: twin.FaultArrays, frame: Frame, orders: Orders, period_s: float
) -> Doubt:
    """As `tick`, under fault rows that may differ from those of the hypotheses."""
    suspect = doubt.suspect
    before_m = twin.report(doubt.states, faults)[:, suspect]
    states = _move(doubt.baseline, faults, doubt.states, suspect, frame, orders, period_s)
    predicted_m = twin.report(states, faults)[:, suspect]
    fit = replace(doubt.fit, path_m=doubt.fit.path_m + np.abs(predicted_m - before_m))
    due = frame.time_s - doubt.judged_s >= diagnosis.SAMPLE_PERIOD_S - 1e-6
    if not (due and frame.fresh[suspect]):
        return replace(doubt, states=states, fit=fit)
    observed_m = frame.position_m[suspect]
    gained = diagnosis.unknown_log_likelihood(observed_m, doubt.last_report_m)
    return replace(
        doubt,
        states=states,
        fit=diagnosis.judge(fit, observed_m, predicted_m),
        unknown=doubt.unknown + gained,
        last_report_m=observed_m,
        judged_s=frame.time_s,
    )


def _move(
    baseline: Baseline,
    faults: twin.FaultArrays,
    states: Array,
    suspect: int,
    frame: Frame,
    orders: Orders,
    period_s: float,
) -> Array:
    moved = twin.advance(
        baseline.model,
        baseline.model.nominal,
        faults,
        states,
        orders.setpoints,
        orders.driven,
        period_s,
    )
    trusted = faults.gps_stuck < 0.5
    trusted[:, suspect] = False
    return correct(moved.states, frame, trusted, period_s / CORRECTION_TIME_S)
