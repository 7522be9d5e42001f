"""A suspect under doubt: one twin per hypothesis, each carrying its own state and its evidence.

While a vehicle is in doubt its twins are driven by the orders sent and by the neighbours as they
are seen, and never drawn towards the suspect's own reports: those are what is being judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station import diagnosis, twin
from base_station.diagnosis import Verdict
from base_station.execution import Orders
from base_station.hypotheses import Hypothesis
from base_station.telemetry import Frame
from base_station.watch import CORRECTION_TIME_S, Baseline, Moment, correct

Array = NDArray[np.float64]

FLOOR = 1e-3  # 'something else' is never ruled out before an experiment
ONSET_STEP_S = 0.3
MAX_ONSETS = 12


@dataclass(frozen=True, eq=False)
class Doubt:
    """`states` [T, V, S], `log_weights` [H], `anchor_m` [T, 2]; the T that have a twin come first.

    `anchor_m` is what each twin expected of the suspect's report when it was last still;
    `last_report_m` the report judged last, at `judged_s`.
    """

    baseline: Baseline
    suspect: int
    hypotheses: tuple[Hypothesis, ...]
    log_weights: Array
    states: Array
    anchor_m: Array
    last_report_m: Array
    judged_s: float

    @property
    def twins(self) -> tuple[Hypothesis, ...]:
        return tuple(h for h in self.hypotheses if h.has_twin)

    @property
    def faults(self) -> twin.FaultArrays:
        return self.baseline.faults(self.twins)

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
        return diagnosis.report_sigma_m(self.report_m[:, self.suspect] - self.anchor_m)

    def verdict(self, decide_at: float) -> Verdict:
        return diagnosis.decide(self.hypotheses, self.log_weights, decide_at)


def tick(doubt: Doubt, frame: Frame, orders: Orders, period_s: float) -> Doubt:
    """Move every twin on by one telemetry period, and judge the suspect's report when it is due."""
    states = _move(
        doubt.baseline, doubt.faults, doubt.states, doubt.suspect, frame, orders, period_s
    )
    doubt = replace(doubt, states=states)
    due = frame.time_s - doubt.judged_s >= diagnosis.SAMPLE_PERIOD_S - 1e-6
    if not (due and frame.fresh[doubt.suspect]):
        return doubt
    observed = frame.position_m[doubt.suspect]
    predicted = doubt.report_m[:, doubt.suspect]
    gained = [
        *diagnosis.twin_log_likelihood(observed, predicted, predicted - doubt.anchor_m),
        *(
            diagnosis.unknown_log_likelihood(observed, doubt.last_report_m)
            for h in doubt.hypotheses
            if not h.has_twin
        ),
    ]
    return replace(
        doubt,
        log_weights=doubt.log_weights + np.array(gained),
        last_report_m=observed,
        judged_s=frame.time_s,
    )


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
    doubt = replace(doubt, states=states)
    return replace(
        doubt,
        anchor_m=doubt.report_m[:, doubt.suspect],
        last_report_m=report_m[doubt.suspect],
    )


def awake(doubt: Doubt) -> Doubt:
    """Lift 'something else' to FLOOR: a fleet at rest suits every twin better than no twin."""
    floor = np.array([0.0 if h.has_twin else FLOOR for h in doubt.hypotheses])
    return replace(doubt, log_weights=np.log(np.maximum(doubt.posterior, floor) + 1e-300))


def narrowed(doubt: Doubt, keep: Sequence[int]) -> tuple[tuple[Hypothesis, ...], Array, Array]:
    """The twins `keep` (indices): hypotheses, renormalised posterior [K] and states [K, V, S]."""
    p = doubt.posterior[list(keep)]
    return tuple(doubt.twins[k] for k in keep), p / p.sum(), doubt.states[list(keep)]


def open_doubt(
    baseline: Baseline,
    memory: Sequence[Moment],
    suspect: int,
    candidates: Sequence[Hypothesis],
    healthy_until_s: float,
    period_s: float,
) -> Doubt:
    """Replay the memory from the last healthy moment under every candidate.

    When exactly the fault struck is unknown: each hypothesis is replayed for several onsets from
    then to the end of the memory, and its evidence is the mean of their likelihoods.
    """
    hypotheses = tuple(sorted(candidates, key=lambda h: not h.has_twin))
    times = np.array([m.frame.time_s for m in memory])
    first = max(0, int(np.searchsorted(times, healthy_until_s)) - 1)
    replayed = memory[first:]
    onsets = _onsets(times[first], times[-1])
    twins = tuple(h for h in hypotheses if h.has_twin)
    count = len(twins)
    struck = baseline.faults(twins * len(onsets))
    sound = baseline.faults([Hypothesis("none", h.sysid, 1.0) for h in twins * len(onsets)])
    onset_of_row = np.repeat(onsets, count)

    states = np.repeat(replayed[0].state[None], len(onset_of_row), axis=0)
    start_m = np.asarray(replayed[0].frame.position_m[suspect], dtype=np.float64)
    anchor_m = np.repeat(twin.report(states, sound)[:, suspect], 1, axis=0)
    rows = np.zeros(len(onset_of_row))
    unknown, last_m, judged_s = 0.0, start_m, replayed[0].frame.time_s
    active = np.zeros(len(onset_of_row), dtype=np.bool_)
    for moment in replayed[1:]:
        frame = moment.frame
        strikes = ~active & (frame.time_s - period_s >= onset_of_row - 1e-6)
        states[strikes, suspect, twin.HELD_NORTH : twin.HELD_EAST + 1] = states[
            strikes, suspect, twin.NORTH : twin.EAST + 1
        ]
        active |= strikes
        faults = twin.FaultArrays(
            np.where(active[:, None, None], struck.power, sound.power),
            np.where(active[:, None, None], struck.gps_stuck, sound.gps_stuck),
        )
        states = _move(baseline, faults, states, suspect, frame, moment.orders, period_s)
        if frame.time_s - judged_s >= diagnosis.SAMPLE_PERIOD_S - 1e-6 and frame.fresh[suspect]:
            observed = frame.position_m[suspect]
            predicted = twin.report(states, faults)[:, suspect]
            rows += diagnosis.twin_log_likelihood(observed, predicted, predicted - anchor_m)
            unknown += diagnosis.unknown_log_likelihood(observed, last_m)
            last_m, judged_s = observed, frame.time_s
    by_onset = rows.reshape(len(onsets), count)
    best = by_onset.argmax(axis=0)
    evidence = _log_mean_exp(by_onset)
    priors = np.log([h.prior for h in hypotheses])
    gained = [*evidence, *(unknown for h in hypotheses if not h.has_twin)]
    chosen = best * count + np.arange(count)
    return Doubt(
        baseline,
        suspect,
        hypotheses,
        priors + gained,
        states[chosen],
        anchor_m[chosen],
        last_m,
        judged_s,
    )


def _onsets(first_s: float, last_s: float) -> Array:
    count = int(np.clip((last_s - first_s) / ONSET_STEP_S, 1, MAX_ONSETS))
    return first_s + ONSET_STEP_S * np.arange(count)


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
