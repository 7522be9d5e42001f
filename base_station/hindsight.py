"""From an alarm to a doubt: the memory replayed under every hypothesis.

When exactly the fault struck is unknown: each hypothesis is replayed for several moments of onset
between the last quiet one and the alarm, and its evidence is the mean of their likelihoods.
"""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from base_station import diagnosis, twin
from base_station.diagnosis import Fit
from base_station.doubt import Doubt, advanced
from base_station.hypotheses import NONE, Hypothesis
from base_station.watch import Baseline, Moment

Array = NDArray[np.float64]

ONSET_STEP_S = 0.3
MAX_ONSETS = 20
ONSET_MARGIN_S = 1.0  # a fault may have been there before the statistic moved


class Hindsight:
    """Takes the memory a few moments at a time, so that no step of the station has to do it all.

    Rows are onsets x twins, the twins running fastest.
    """

    def __init__(
        self,
        baseline: Baseline,
        memory: Sequence[Moment],
        suspect: int,
        candidates: Sequence[Hypothesis],
        between_s: tuple[float, float],
        period_s: float,
    ) -> None:
        self._hypotheses = tuple(sorted(candidates, key=lambda h: not h.has_twin))
        self._twins = tuple(h for h in self._hypotheses if h.has_twin)
        self._period_s = period_s
        times = np.array([m.frame.time_s for m in memory])
        start = int(np.searchsorted(times, between_s[0] - ONSET_MARGIN_S)) - 1
        first = memory[max(0, start)]
        self._onsets = _onsets(first.frame.time_s, between_s[1])
        every = self._twins * len(self._onsets)
        self._struck = baseline.faults(every)
        self._sound = baseline.faults([Hypothesis(NONE, h.sysid, 1.0) for h in every])
        self._active = np.zeros(len(every), dtype=np.bool_)
        self._rows = Doubt(
            baseline=baseline,
            suspect=suspect,
            hypotheses=every,
            prior=np.zeros(len(every)),
            states=np.repeat(first.state[None], len(every), axis=0),
            fit=diagnosis.fresh_fit(len(every)),
            unknown=0.0,
            last_report_m=np.asarray(first.frame.position_m[suspect]),
            judged_s=first.frame.time_s,
        )
        self.time_s = first.frame.time_s  # of the last moment taken

    def take(self, memory: Sequence[Moment], most: int) -> bool:
        """Replay up to `most` moments that have not been taken; whether that was all of them."""
        new = [m for m in memory if m.frame.time_s > self.time_s + 1e-6]
        for moment in new[:most]:
            self._strike(moment.frame.time_s - self._period_s)
            rows, faults = self._rows, self._faults()
            self._rows = advanced(rows, faults, moment.frame, moment.orders, self._period_s)
            self.time_s = moment.frame.time_s
        return len(new) <= most

    def doubt(self) -> Doubt:
        """What is to be believed of each hypothesis, each at its likeliest onset."""
        count = len(self._twins)
        by_onset = self._rows.fit.log_likelihood.reshape(len(self._onsets), count)
        chosen = by_onset.argmax(axis=0) * count + np.arange(count)
        fit = Fit(*(getattr(self._rows.fit, f.name)[chosen] for f in fields(Fit)))
        return replace(
            self._rows,
            hypotheses=self._hypotheses,
            prior=np.log([h.prior for h in self._hypotheses]),
            states=self._rows.states[chosen],
            fit=replace(fit, log_likelihood=_log_mean_exp(by_onset)),
        )

    def _strike(self, time_s: float) -> None:
        """Faults whose onset has come by `time_s` are in effect; a stuck axis holds its place."""
        onset_of_row = np.repeat(self._onsets, len(self._twins))
        strikes = ~self._active & (time_s >= onset_of_row - 1e-6)
        suspect = self._rows.states[:, self._rows.suspect]
        suspect[strikes, twin.HELD_NORTH : twin.HELD_EAST + 1] = suspect[
            strikes, twin.NORTH : twin.EAST + 1
        ]
        self._active |= strikes

    def _faults(self) -> twin.FaultArrays:
        active, struck, sound = self._active[:, None, None], self._struck, self._sound
        return twin.FaultArrays(
            np.where(active, struck.power, sound.power),
            np.where(active, struck.gps_stuck, sound.gps_stuck),
        )


def _onsets(first_s: float, last_s: float) -> Array:
    count = int(np.clip((last_s - first_s) / ONSET_STEP_S + 1, 1, MAX_ONSETS))
    return np.linspace(first_s, last_s, count)


def _log_mean_exp(values: Array) -> Array:
    """Over the first axis."""
    top = values.max(axis=0)
    mean: Array = np.exp(values - top).mean(axis=0)
    return np.asarray(top + np.log(mean))
