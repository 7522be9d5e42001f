"""From an alarm to a doubt: the memory replayed under every hypothesis.

When exactly the fault struck is unknown, as gains and sizes are, and where the fleet was before it:
each draw of a hypothesis has its own moment of onset between the last quiet one and the alarm, and
begins where one of the ensemble of believed twins was.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.belief import diagnosis, hearing, particles
from base_station.belief.diagnosis import ReportFaults
from base_station.belief.doubt import Doubt, advanced
from base_station.belief.hypotheses import NONE, Hypothesis
from base_station.belief.watch import Baseline, Moment
from base_station.execution import REST_S

Array = NDArray[np.float64]

ONSET_MARGIN_S = 1.0  # a fault may have been there before the statistic moved
UNNOTICED_S = 20.0  # and for so long where the link is at its worst: a wide spread hides much
TRAIL_S = 1.8  # longer than the longest delay that a hypothesis has, and a fix is old


def _begin_s(memory: Sequence[Moment], quiet_s: float, period_s: float) -> float:
    """When a fault may have struck at the earliest; not before the fleet was last out of touch."""
    certain_s = quiet_s - ONSET_MARGIN_S
    troubled = float(hearing.trouble(memory[-1].frame, period_s).max()) / hearing.WORST
    heard_s = [
        m.frame.time_s + REST_S
        for m in memory
        if m.frame.time_s < certain_s and not m.frame.fresh.all()
    ]
    return min(certain_s, max([certain_s - UNNOTICED_S * troubled, *heard_s]))


class Hindsight:
    """Takes the memory a few moments at a time, so that no step of the station has to do it all."""

    def __init__(
        self,
        baseline: Baseline,
        memory: Sequence[Moment],
        suspect: int,
        candidates: Sequence[Hypothesis],
        between_s: tuple[float, float],
        period_s: float,
    ) -> None:
        hypotheses = tuple(sorted(candidates, key=lambda h: not h.has_twin))
        twins = [h for h in hypotheses if h.has_twin]
        self._period_s = period_s
        times = np.array([m.frame.time_s for m in memory])
        start = int(np.searchsorted(times, _begin_s(memory, between_s[0], period_s))) - 1
        first = memory[max(0, start)]
        sent = [(m.orders, m.frame) for m in memory[: max(0, start) + 1]]
        rng = np.random.default_rng(round(between_s[1] * 1000))
        drawn = particles.draw(baseline, twins, rng)
        rows = particles.DRAWS * len(twins)
        span_s = between_s[1] - first.frame.time_s
        self._onset_s = first.frame.time_s + span_s * np.repeat(
            particles.stratified(rng), len(twins)
        )
        self._sound = baseline.faults([Hypothesis(NONE, h.sysid, 1.0) for h in twins[:1]])
        self._active = np.zeros(rows, dtype=np.bool_)
        members = first.states[np.arange(particles.DRAWS) % len(first.states)]
        states = np.repeat(members, len(twins), axis=0)
        there_m = twin.report(states, drawn.motion)[:, suspect]
        said_m = np.asarray(first.frame.position_m[suspect])
        self._rows = Doubt(
            baseline=baseline,
            suspect=suspect,
            hypotheses=hypotheses,
            particles=drawn,
            prior=np.log([h.prior for h in hypotheses]),
            states=states,
            trail_m=np.repeat(there_m[None], round(TRAIL_S / period_s), axis=0),
            hearing=hearing.nothing_yet(particles.DRAWS, baseline.model.size, sent),
            fit=diagnosis.fresh_fit(rows),
            unknown=0.0,
            last_report_m=np.where(first.frame.fresh[suspect], said_m, there_m[0]),
            judged_s=first.frame.time_s,
        )
        self.time_s = first.frame.time_s  # of the last moment taken

    def take(self, memory: Sequence[Moment], most: int) -> bool:
        """Replay up to `most` moments that have not been taken; whether that was all of them."""
        new = [m for m in memory if m.frame.time_s > self.time_s + 1e-6]
        for moment in new[:most]:
            self._strike(moment.frame.time_s - self._period_s)
            self._rows = advanced(
                self._rows, *self._faults(), moment.frame, moment.orders, self._period_s
            )
            self.time_s = moment.frame.time_s
        return len(new) <= most

    def doubt(self) -> Doubt:
        """What is to be believed of each hypothesis."""
        return self._rows

    def _strike(self, time_s: float) -> None:
        """Faults whose onset has come by `time_s` are in effect; a stuck axis holds its place."""
        strikes = ~self._active & (time_s >= self._onset_s - 1e-6)
        if not strikes.any():
            return
        states = self._rows.states.copy()
        suspect = states[:, self._rows.suspect]
        suspect[strikes, twin.HELD_NORTH : twin.HELD_EAST + 1] = suspect[
            strikes, twin.NORTH : twin.EAST + 1
        ]
        fit = diagnosis.struck(self._rows.fit, self._rows.particles.reports, strikes)
        self._rows = replace(self._rows, states=states, fit=fit)
        self._active |= strikes

    def _faults(self) -> tuple[twin.FaultArrays, ReportFaults]:
        drawn, on = self._rows.particles, self._active[:, None, None]
        motion = (np.where(on, f, s) for f, s in zip(drawn.motion, self._sound, strict=True))
        reports = drawn.reports
        return twin.FaultArrays(*motion), reports._replace(
            noise_m=np.where(self._active, reports.noise_m, 0.0),
            lag_s=np.where(self._active, reports.lag_s, 0.0),
        )
