"""What each hypothesis believes, tick by tick: its ghost fleet, its evidence, its posterior."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from base_station.belief.hypotheses import UNKNOWN
from base_station.recording import columns as col
from base_station.recording import scene
from base_station.recording.palette import hypothesis_color
from base_station.recording.trails import Trails
from base_station.records import TwinSnapshot
from hil.scenario import StationView

SIGMAS = 2.0  # half size of a spot
MIN_SPOT_M = 0.03  # so that a certain prediction is still seen
ELSEWHERE_M = 0.02  # a twin's report is drawn where it is off its body, or uncertain
LINE_FROM, LINE_TO = 0.01, 0.001  # a posterior's line begins at the one, ends below the other
LIKELY_M = 0.009  # a likelier twin's ring lies this much higher: it is not covered by others
SLOW_S = 0.5  # between rows of the belief while there is no doubt
EARLY_S = 1e-6
FLOOR_NATS = -50.0  # further behind the best makes no difference


class TwinRows:
    """One entity per hypothesis in space and for its posterior; evidence of all in one entity.

    A hypothesis has a posterior's line while it is in the running: most never are.
    """

    def __init__(self, batch: col.Batch, stream: Any, view: StationView) -> None:
        self._batch, self._stream = batch, stream
        self._radii_m = [m.frame.radius_m for m in view.fleet]
        self._order = scene.hypotheses(view)
        self._trails = Trails()
        self._segments: list[tuple[float, ...]] = []  # of this tick
        self._styled: set[str] = set()
        self._lines: set[str] = set()  # hypotheses whose posterior is being drawn ...
        self._known_lines: set[str] = set()  # ... or was once
        self._shown: tuple[TwinSnapshot, ...] = ()
        self._told_s = -math.inf

    def add(self, time_s: float, twins: Sequence[TwinSnapshot]) -> None:
        names = tuple(t.hypothesis for t in twins)
        for gone in sorted({t.hypothesis for t in self._shown} - set(names)):
            self._batch.add(f"/twins/{gone}/body", col.RINGS, ())
            self._batch.add(f"/twins/{gone}/report", col.SPOTS, ())
            self._trails.forget(gone)
        self._shown = tuple(twins)
        if new := tuple(name for name in names if name not in self._order):
            self._order += new
            scene.style_belief(self._stream, self._order)
        for twin in twins:
            self._ghosts(twin, doubted=len(twins) > 1)
        if self._segments:
            self._batch.add(scene.TWIN_TRAILS, col.SEGMENTS, self._segments)
            self._segments = []
        if len(twins) != 1 or time_s - self._told_s >= SLOW_S - EARLY_S:
            self._told_s = time_s
            self._posterior({t.hypothesis: t.posterior for t in twins})
            self._evidence(twins)

    def _posterior(self, posterior: dict[str, float]) -> None:
        """'unknown' has no twin; what the others leave is its share."""
        posterior.setdefault(UNKNOWN, max(0.0, 1.0 - sum(posterior.values())))
        drawn = {
            name
            for name, p in posterior.items()
            if p >= (LINE_TO if name in self._lines else LINE_FROM)
        }
        for name in sorted(drawn | self._lines):
            path = f"/belief/posterior/{name}"
            if name not in self._known_lines:
                self._known_lines.add(name)
                scene.style_posterior(self._stream, path, name)
            self._batch.add(path, col.SCALARS, posterior[name] if name in drawn else 0.0)
        self._lines = drawn

    def _evidence(self, twins: Sequence[TwinSnapshot]) -> None:
        best = max((t.log_likelihood for t in twins), default=0.0)
        evidence = {t.hypothesis: t.log_likelihood for t in twins}
        behind = {name: max(FLOOR_NATS, value - best) for name, value in evidence.items()}
        self._series("log_likelihood", evidence)
        self._series("behind_best", behind)

    def _series(self, quantity: str, values: dict[str, float]) -> None:
        row = [values.get(name, np.nan) for name in self._order]
        self._batch.add(f"/belief/{quantity}", col.SCALARS, row)

    def _ghosts(self, twin: TwinSnapshot, doubted: bool) -> None:
        name, root = twin.hypothesis, f"/twins/{twin.hypothesis}"
        if not (np.isfinite(twin.true_m).all() and np.isfinite(twin.report_m).all()):
            return
        if name not in self._styled:
            self._styled.add(name)
            scene.style_twin(self._stream, name)
        z_m = scene.TWIN_Z_M + LIKELY_M * twin.posterior
        bodies = [scene.at(n, e, z_m) for n, e in twin.true_m.tolist()]
        rings = [(*place, radius_m) for place, radius_m in zip(bodies, self._radii_m, strict=True)]
        self._batch.add(f"{root}/body", col.RINGS, rings)
        self._batch.add(f"{root}/report", col.SPOTS, _spots(twin, doubted))
        color = hypothesis_color(name)
        steps = [self._trails.step((name, k), place, color) for k, place in enumerate(bodies)]
        if moved := [step for step in steps if step]:
            self._segments += moved


def _spots(twin: TwinSnapshot, doubted: bool) -> list[tuple[float, ...]]:
    """Where the station would receive a vehicle to be, give or take while that is in doubt."""
    spots: list[tuple[float, ...]] = []
    rows = zip(twin.true_m.tolist(), twin.report_m.tolist(), twin.sigma_m.tolist(), strict=True)
    for (true_n, true_e), (north, east), (sigma_n, sigma_e) in rows:
        elsewhere = abs(north - true_n) + abs(east - true_e) > ELSEWHERE_M
        if elsewhere or (doubted and (sigma_n > 0.0 or sigma_e > 0.0)):
            half = scene.at(_half_m(sigma_n, doubted), _half_m(sigma_e, doubted), col.RING_M)
            spots.append((*scene.at(north, east, scene.REPORT_Z_M), *half))
    return spots


def _half_m(sigma_m: float, doubted: bool) -> float:
    return max(MIN_SPOT_M, SIGMAS * sigma_m if doubted else 0.0)  # NaN becomes the minimum, too
