"""A suspect under doubt: one twin per hypothesis, each carrying its own state and its evidence.

While a vehicle is in doubt its twins are driven by the orders sent and by the neighbours as they
are seen, and never drawn towards the suspect's own reports: those are what is being judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from base_station import diagnosis, twin
from base_station.diagnosis import Fit, Verdict
from base_station.execution import Orders
from base_station.hypotheses import NONE, Hypothesis
from base_station.telemetry import Frame
from base_station.watch import CORRECTION_TIME_S, Baseline, Moment, correct

Array = NDArray[np.float64]

FLOOR = 1e-3  # 'something else' is never ruled out before an experiment
ONSET_STEP_S = 0.3
MAX_ONSETS = 20
ONSET_MARGIN_S = 1.0  # a fault may have been there before the statistic moved


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
    return _advanced(doubt, doubt.faults, frame, orders, period_s)


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


def open_doubt(
    baseline: Baseline,
    memory: Sequence[Moment],
    suspect: int,
    candidates: Sequence[Hypothesis],
    between_s: tuple[float, float],
    period_s: float,
) -> Doubt:
    """Replay the memory from the last healthy moment under every candidate.

    When exactly the fault struck is unknown, somewhere in `between_s` (last quiet, alarm): each
    hypothesis is replayed for several onsets, and its evidence is the mean of their likelihoods.
    """
    hypotheses = tuple(sorted(candidates, key=lambda h: not h.has_twin))
    twins = tuple(h for h in hypotheses if h.has_twin)
    start_s = between_s[0] - ONSET_MARGIN_S
    times = np.array([m.frame.time_s for m in memory])
    first, *replayed = memory[max(0, int(np.searchsorted(times, start_s)) - 1) :]
    onsets = _onsets(first.frame.time_s, between_s[1])
    struck = baseline.faults(twins * len(onsets))
    sound = baseline.faults([Hypothesis(NONE, h.sysid, 1.0) for h in twins * len(onsets)])
    onset_of_row = np.repeat(onsets, len(twins))
    rows = Doubt(
        baseline=baseline,
        suspect=suspect,
        hypotheses=twins * len(onsets),
        prior=np.zeros(len(onset_of_row)),
        states=np.repeat(first.state[None], len(onset_of_row), axis=0),
        fit=diagnosis.fresh_fit(len(onset_of_row)),
        unknown=0.0,
        last_report_m=np.asarray(first.frame.position_m[suspect]),
        judged_s=first.frame.time_s,
    )
    active = np.zeros(len(onset_of_row), dtype=np.bool_)
    for moment in replayed:
        strikes = ~active & (moment.frame.time_s - period_s >= onset_of_row - 1e-6)
        rows.states[strikes, suspect, twin.HELD_NORTH : twin.HELD_EAST + 1] = rows.states[
            strikes, suspect, twin.NORTH : twin.EAST + 1
        ]
        active |= strikes
        faults = twin.FaultArrays(
            np.where(active[:, None, None], struck.power, sound.power),
            np.where(active[:, None, None], struck.gps_stuck, sound.gps_stuck),
        )
        rows = _advanced(rows, faults, moment.frame, moment.orders, period_s)
    by_onset = rows.fit.log_likelihood.reshape(len(onsets), len(twins))
    chosen = by_onset.argmax(axis=0) * len(twins) + np.arange(len(twins))
    fit = Fit(*(getattr(rows.fit, f.name)[chosen] for f in fields(Fit)))
    return replace(
        rows,
        hypotheses=hypotheses,
        prior=np.log([h.prior for h in hypotheses]),
        states=rows.states[chosen],
        fit=replace(fit, log_likelihood=_log_mean_exp(by_onset)),
    )


def _onsets(first_s: float, last_s: float) -> Array:
    count = int(np.clip((last_s - first_s) / ONSET_STEP_S + 1, 1, MAX_ONSETS))
    return np.linspace(first_s, last_s, count)


def _advanced(
    doubt: Doubt, faults: twin.FaultArrays, frame: Frame, orders: Orders, period_s: float
) -> Doubt:
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


def _log_mean_exp(values: Array) -> Array:
    """Over the first axis."""
    top = values.max(axis=0)
    mean: Array = np.exp(values - top).mean(axis=0)
    return np.asarray(top + np.log(mean))
