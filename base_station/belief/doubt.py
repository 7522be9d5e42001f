"""A suspect under doubt: twins for each hypothesis, each carrying its own state and its evidence.

While a vehicle is in doubt its twins are driven by the orders sent and by the neighbours as they
are seen, and never drawn towards the suspect's own reports: those are what is being judged.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.belief import diagnosis, fixes, hearing, observer, particles
from base_station.belief.diagnosis import Fit, ReportFaults, Verdict
from base_station.belief.fixes import Fixes
from base_station.belief.hearing import Hearing
from base_station.belief.hypotheses import Hypothesis
from base_station.belief.particles import DRAWS, Particles
from base_station.belief.watch import CORRECTION_TIME_S, Baseline
from base_station.execution import Orders
from base_station.receiving.telemetry import Frame
from hil.faults import Type, Unit

Array = NDArray[np.float64]

ACROSS = 1.0  # a heading off by MODEL_ERROR (6 degrees) takes so much of a motion to the other axis
PASSIVE_AT_MOST = 0.9  # for one explanation, from ordinary driving by a troubled link
FLOOR = 1e-3  # 'something else' is never ruled out before an experiment


@dataclass(frozen=True, eq=False)
class Doubt:
    """`prior` [H] are log weights before `fit` and `unknown` began; T of the H have a twin, first.

    Rows [R] are those of `particles`: `states` [R, V, S]; `trail_m` [L, R, 2] what they expected
    of the suspect at the last ticks, the newest last. `last_report_m` [2] was judged at `judged_s`.
    """

    baseline: Baseline
    suspect: int
    hypotheses: tuple[Hypothesis, ...]
    particles: Particles
    prior: Array
    states: Array
    trail_m: Array
    hearing: Hearing
    fit: Fit
    unknown: float
    last_report_m: Array
    judged_s: float
    fixes: Fixes = field(default_factory=Fixes.none)

    @property
    def twins(self) -> tuple[Hypothesis, ...]:
        return self.particles.twins

    @property
    def log_weights(self) -> Array:
        """[H], not normalised: the evidence of a twin is the mean over its draws."""
        evidence = _log_mean_exp(self.fit.log_likelihood.reshape(DRAWS, -1))
        beyond = [self.unknown] * (len(self.hypotheses) - len(self.twins))
        said = self.fixes.log_likelihood(self.hypotheses)
        return np.asarray(self.prior + np.array([*evidence, *beyond]) + said)

    @property
    def posterior(self) -> Array:
        """[H], sums to 1."""
        return diagnosis.posterior(self.log_weights)

    @property
    def likeliest(self) -> Array:
        """[T] for each twin the row that explains the reports best."""
        by_draw = self.fit.log_likelihood.reshape(DRAWS, -1)
        return np.asarray(by_draw.argmax(axis=0) * len(self.twins) + np.arange(len(self.twins)))

    def of_twins(self) -> tuple[Array, Array, Array]:
        """For each twin its likeliest row: state [T, V, S], report [T, V, 2], sigma [T, 2]."""
        rows, motion = self.likeliest, self.particles.motion
        faults = twin.FaultArrays(*(f[rows] for f in motion))
        sigma_m = diagnosis.sigma_m(self.fit, self.particles.reports.noise_m)[rows]
        reports_m = twin.report(self.states[rows], faults)
        reports_m[:, self.suspect] += self.fit.offset_m[rows]
        return self.states[rows], reports_m, sigma_m

    def estimated(self, index: int) -> Hypothesis:
        """A twin's hypothesis with the size of its fault as far as it is known by now."""
        hypothesis, count = self.twins[index], len(self.twins)
        weights = diagnosis.posterior(self.fit.log_likelihood[index::count])
        if hypothesis.kind == (Unit.GPS, Type.OFFSET):
            north, east = (float(x) for x in weights @ self.fit.offset_m[index::count])
            return hypothesis.sized(north, east, 0.0)
        if hypothesis.kind == (Unit.GPS, Type.DRIFT):
            north, east = (float(x) for x in weights @ self.fit.drift_mps[index::count])
            return hypothesis.sized(north, east, 0.0)
        size = float(weights @ self.particles.sizes[index::count])
        return hypothesis if np.isnan(size) else hypothesis.sized(size)

    def verdict(self, decide_at: float) -> Verdict:
        return diagnosis.decide(self.hypotheses, self.log_weights, decide_at)


def tick(doubt: Doubt, frame: Frame, orders: Orders, period_s: float) -> Doubt:
    """Move every twin on by one telemetry period, and judge the suspect's report when it is due."""
    faults, corrected = doubt.particles, doubt.baseline.corrected(frame)
    return advanced(doubt, faults.motion, faults.reports, corrected, orders, period_s)


def anchor(doubt: Doubt, report_m: Array) -> Doubt:
    """Start afresh from a fleet at rest in HOLD whose mean reports are `report_m` [V, 2].

    Draws that explained little make room for others. Every twin takes over what its hypothesis
    trusts; on a stuck axis the report only says where it is stuck, and after a jump or a drift how
    far off it is: there the vehicle stays where this twin has reckoned it to be.
    """
    rng = np.random.default_rng(round(doubt.judged_s * 1000))
    drawn, rows = particles.resampled(
        doubt.particles, doubt.baseline, doubt.fit.log_likelihood.reshape(DRAWS, -1), rng
    )
    states = doubt.states[rows]
    stuck = drawn.motion.gps_stuck > 0.5
    blind = stuck.copy()
    moved_off = drawn.reports.drift_mps > 0.0
    blind[:, doubt.suspect] |= moved_off[:, None]
    position = states[..., twin.NORTH : twin.EAST + 1]
    held = states[..., twin.HELD_NORTH : twin.HELD_EAST + 1]
    position[...] = np.where(blind, position, report_m)
    held[...] = np.where(stuck, report_m, held)
    for column in (twin.V_NORTH, twin.V_EAST, twin.YAW_RATE, twin.I_X, twin.I_Y):
        states[..., column] = 0.0
    suspect_m = twin.report(states, drawn.motion)[:, doubt.suspect]
    return replace(
        doubt,
        particles=drawn,
        prior=np.log(doubt.posterior + 1e-300),
        states=states,
        trail_m=np.repeat(suspect_m[None], len(doubt.trail_m), axis=0),
        fit=diagnosis.carried_over(doubt.fit, rows, moved_off),
        unknown=0.0,
        last_report_m=report_m[doubt.suspect],
        fixes=Fixes.none(),
    )


def awake(doubt: Doubt) -> Doubt:
    """Lift 'something else' to FLOOR: a fleet at rest suits every twin better than no twin."""
    floor = np.array([0.0 if h.has_twin else FLOOR for h in doubt.hypotheses])
    weights = np.log(np.maximum(doubt.posterior, floor) + 1e-300)
    return replace(doubt, prior=weights + doubt.prior - doubt.log_weights)


def questioned(doubt: Doubt) -> Doubt:
    """What ordinary driving by a troubled link has told: half the evidence so far, as log weights,
    for errors of one cause were counted as many; and not enough to decide without an experiment."""
    weights = 0.5 * np.log(doubt.posterior + 1e-300)
    p = diagnosis.posterior(weights)
    best = np.arange(len(p)) == p.argmax()
    odds, most = p[best].sum() / p[~best].sum(), PASSIVE_AT_MOST / (1.0 - PASSIVE_AT_MOST)
    if odds > most:
        weights = weights - np.where(best, np.log(odds / most), 0.0)
    return replace(doubt, prior=weights + doubt.prior - doubt.log_weights)


def narrowed(doubt: Doubt, keep: Sequence[int]) -> tuple[tuple[Hypothesis, ...], Array, Array]:
    """The twins `keep` (indices): hypotheses, renormalised posterior [K] and states [K, V, S]."""
    p = doubt.posterior[list(keep)]
    states = doubt.of_twins()[0]
    return tuple(doubt.estimated(k) for k in keep), p / p.sum(), states[list(keep)]


def advanced(
    doubt: Doubt,
    motion: twin.FaultArrays,
    reports: ReportFaults,
    frame: Frame,
    orders: Orders,
    period_s: float,
) -> Doubt:
    """As `tick`, under faults that may differ from those of the hypotheses."""
    suspect = doubt.suspect
    heard = hearing.heard(doubt.hearing, orders, frame, period_s)
    states = _move(doubt, motion, frame, heard, period_s)
    trail_m = np.roll(doubt.trail_m, -1, axis=0)
    trail_m[-1] = twin.report(states, motion)[:, suspect]
    now_m, before_m = (_ago(trail_m, reports.lag_s + s, period_s) for s in (0.0, period_s))
    across_m = _across(doubt.states, states, suspect) * (motion.gps_stuck[:, suspect] < 0.5)
    fit = replace(doubt.fit, path_m=doubt.fit.path_m + np.abs(now_m - before_m) + across_m)
    doubt = replace(doubt, fixes=doubt.fixes.heard(frame, suspect))
    seen_s = fixes.seen_s(frame, suspect)
    since_s = seen_s - doubt.judged_s
    if since_s < diagnosis.SAMPLE_PERIOD_S - 1e-6 or not frame.fresh[suspect]:
        return replace(doubt, states=states, trail_m=trail_m, hearing=heard, fit=fit)
    observed_m = fixes.seen_m(frame, suspect)[suspect]
    expected_m = _ago(trail_m, reports.lag_s + (frame.time_s - seen_s), period_s)
    gained = diagnosis.unknown_log_likelihood(observed_m, doubt.last_report_m)
    return replace(
        doubt,
        states=states,
        trail_m=trail_m,
        hearing=heard,
        fit=diagnosis.judge(fit, observed_m, expected_m, reports, since_s),
        unknown=doubt.unknown + gained,
        last_report_m=observed_m,
        judged_s=seen_s,
    )


def _ago(trail_m: Array, late_s: Array, period_s: float) -> Array:
    """[R, 2] what each row expected `late_s` [R] ago, as far back as the trail goes."""
    age = np.minimum(np.round(late_s / period_s).astype(np.intp), len(trail_m) - 1)
    return np.asarray(trail_m[-1 - age, np.arange(len(age))])


def _across(before: Array, after: Array, suspect: int) -> Array:
    """[R, 2] what motion along one axis may do to the other: friction holds what moves less."""
    axes = slice(twin.NORTH, twin.EAST + 1)
    return ACROSS * np.abs(after[:, suspect, axes] - before[:, suspect, axes])[:, ::-1]


def _move(
    doubt: Doubt, motion: twin.FaultArrays, frame: Frame, heard: Hearing, period_s: float
) -> Array:
    moved = twin.advance(
        doubt.baseline.model,
        doubt.particles.parameters,
        motion,
        doubt.states,
        *heard.of_rows(len(doubt.states)),
        period_s,
    )
    trusted = motion.gps_stuck < 0.5
    trusted[:, doubt.suspect] = False
    gain = np.full((1, 1), period_s / CORRECTION_TIME_S)
    return observer.corrected(moved.states, frame, frame.position_m, trusted, gain)


def _log_mean_exp(values: Array) -> Array:
    """Over the first axis."""
    top = values.max(axis=0)
    mean: Array = np.exp(values - top).mean(axis=0)
    return np.asarray(top + np.log(mean))
