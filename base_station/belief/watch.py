"""The believed twin run beside the fleet: its residuals, its alarm, and its memory.

Each tick the ensemble of `observer` is moved on under the orders that were sent, compared with what
was received, and drawn towards it on the axes that are trusted. The residual is the difference from
the nominal twin before the drawing, in units of its predicted spread.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.belief import detection, fixes, hearing, observer
from base_station.belief.hypotheses import NONE, Hypothesis
from base_station.execution import Orders
from base_station.fitted import residual_m
from base_station.receiving.telemetry import Frame
from hil.faults import Type, Unit
from hil.scenario import StationView

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CORRECTION_TIME_S = 1.0  # how fast the twin follows what is received
NOISE_SIGMA_M = 0.02  # of one report after the vehicle's filter
SPREAD_FACTOR = (
    2.5  # a vehicle keeps its parameters: its error is one draw, not a new one each tick
)
LINK_FACTOR = 2.5  # more where the link is bad: what it does to orders is not Gaussian
NOISY_M = 0.1  # a noisier report is followed the more slowly
MEMORY_S = 60.0


@dataclass(frozen=True, eq=False)
class Moment:
    """One tick of the memory: what arrived, the orders before it, and the ensemble of twins after
    it [M, V, S]."""

    frame: Frame
    orders: Orders
    states: Array


@dataclass(frozen=True, eq=False)
class Baseline:
    """Everything that is taken for granted: the model, and the faults already established."""

    model: twin.FleetModel
    known: tuple[Hypothesis, ...] = ()

    def faults(self, hypotheses: Sequence[Hypothesis]) -> twin.FaultArrays:
        """[H] fault rows of `hypotheses`, each on top of what is known."""
        rows = twin.fault_rows(self.model, hypotheses)
        if not self.known:
            return rows
        known = twin.fault_rows(self.model, self.known)
        return twin.FaultArrays(
            rows.power * known.power.min(axis=0),
            rows.gain * known.gain.prod(axis=0),
            np.maximum(rows.gps_stuck, known.gps_stuck.max(axis=0)),
        )

    @property
    def blind(self) -> Flags:
        """[V, 2]: axes of which no report tells where the vehicle is: stuck, or drifting."""
        blind = twin.fault_rows(self.model, (_nothing_more(self.model), *self.known))
        axes = np.asarray(blind.gps_stuck.max(axis=0) > 0.5)
        for hypothesis in self.known:
            if hypothesis.kind == (Unit.GPS, Type.DRIFT):
                axes[self.model.index(hypothesis.sysid)] = True
        return axes

    @property
    def report_sigma_m(self) -> Array:
        """[V]: how far off a report may be, beyond the usual; a late one by what is driven then."""
        sigma_m = np.zeros(self.model.size)
        for hypothesis in self.known:
            if hypothesis.fault and hypothesis.kind in (
                (Unit.GPS, Type.NOISE),
                (Unit.GPS, Type.DELAY),
            ):
                sigma_m[self.model.index(hypothesis.sysid)] += hypothesis.fault.size[0]
        return sigma_m

    def corrected(self, frame: Frame) -> Frame:
        """The frame without the constant errors that are known.

        Of a receiver that is known to be stuck its own word, not what an estimator makes of it.
        """
        position_m = frame.position_m
        for hypothesis in self.known:
            if hypothesis.kind == (Unit.GPS, Type.STUCK):
                told = replace(frame, position_m=position_m)
                position_m = fixes.seen_m(told, self.model.index(hypothesis.sysid))
            if hypothesis.fault and hypothesis.kind == (Unit.GPS, Type.OFFSET):
                position_m = position_m.copy()
                position_m[self.model.index(hypothesis.sysid)] -= hypothesis.fault.size[:2]
        return replace(frame, position_m=position_m)

    def with_known(self, hypothesis: Hypothesis) -> "Baseline":
        return replace(self, known=(*self.known, hypothesis))


class Watch:
    """Runs the believed twin tick by tick. `level` is compared with `threshold` for an alarm."""

    def __init__(self, view: StationView, baseline: Baseline, state: Array, time_s: float) -> None:
        self.baseline = baseline
        self._faults = baseline.faults((_nothing_more(baseline.model),))
        self._trusted = ~baseline.blind
        self._noise_m = np.hypot(baseline.report_sigma_m, residual_m(view))[:, None]
        self._period_s = 1.0 / view.clock.telemetry_hz
        self._observer = observer.start(baseline.model, state)
        self.sigma_m = np.full((len(view.fleet), 2), NOISE_SIGMA_M)  # of the residual, in metres
        self.travelled_m = [0.0] * len(view.fleet)  # by the twin, since this belief began
        self.threshold = detection.threshold(
            view.diagnosis.false_alarms_per_hour, view.clock.telemetry_hz, len(view.fleet)
        )
        self.cusum = detection.start(len(view.fleet), time_s)
        self.residual = np.full((len(view.fleet), 2), np.nan)
        self.contacts: tuple[tuple[int, int], ...] = ()
        self.memory: deque[Moment] = deque(maxlen=round(MEMORY_S / self._period_s))

    @property
    def state(self) -> Array:
        """[V, S]: the nominal twin, where the fleet is believed to be."""
        return np.asarray(self._observer.states[0])

    @property
    def report_m(self) -> Array:
        """[V, 2]: what the believed twin expects to receive."""
        return np.asarray(twin.report(self.state[None], self._faults)[0])

    def tick(self, frame: Frame, orders: Orders) -> tuple[int, ...]:
        """Move on under `orders` to `frame`; indices of the vehicles whose alarm stands now."""
        frame, before = self.baseline.corrected(frame), self.state
        expected, impulses_ns = observer.moved(
            self._observer, self.baseline.model, self._faults, orders, frame, self._period_s
        )
        self.contacts = tuple((int(a), int(b)) for a, b in np.argwhere(impulses_ns > 0.0) if a < b)
        steps = (expected.states[0] - before)[:, twin.NORTH : twin.EAST + 1]
        self.travelled_m = [
            m + float(np.hypot(*d)) for m, d in zip(self.travelled_m, steps, strict=True)
        ]
        reports_m = twin.report(expected.states, self._faults)
        # a wall pins all members, but not the slow error of the reports
        slow_m = np.maximum(observer.spread_m(reports_m), observer.REPORT_ERROR_M)
        factor = SPREAD_FACTOR + LINK_FACTOR * hearing.trouble(frame, self._period_s)[:, None]
        spread_m = factor * slow_m + expected.slack_m[:, None]
        self.sigma_m = np.sqrt(NOISE_SIGMA_M**2 + self._noise_m**2 + spread_m**2)
        self.residual = (frame.position_m - reports_m[0]) / self.sigma_m
        self.cusum = detection.update(self.cusum, self.residual, frame.time_s)
        slowness = 1.0 + self._noise_m / NOISY_M
        gain = self._period_s / (CORRECTION_TIME_S * slowness)
        self._observer = observer.drawn(expected, frame, self._trusted, gain)
        self.memory.append(Moment(frame, orders, self._observer.states))
        return tuple(int(v) for v in np.flatnonzero(self.cusum.level.max(axis=1) > self.threshold))

    def restart(self, at_rest: Frame) -> None:
        """After a gap: all stand where they are seen, as far as that is trusted."""
        self._observer = observer.at_rest(self._observer, at_rest, self._trusted)
        self.cusum = detection.start(len(at_rest.fresh), at_rest.time_s)


def _nothing_more(model: twin.FleetModel) -> Hypothesis:
    return Hypothesis(NONE, model.sysids[0], 1.0)
