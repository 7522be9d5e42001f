"""Learning curves, and what is expected of a plan before it is driven."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from base_station.planning.requests import PlanProgress, PlanReady, Training
from base_station.recording import columns as col
from base_station.recording import palette, scene
from base_station.records import Foreseen

ALPHA_SHOWN_IN = ("plan_alpha", "experiment", "plan_beta")
BETA_SHOWN_IN = ("plan_beta", "mission", "return", "done")
Array = NDArray[np.float64]

LAYER_M = 0.003  # between the lines of two hypotheses


class LearningRows:
    """Curves are /learning/<kind>/<number>/attempt_<k>; the caller has set the time.

    Plans are /plan/alpha/<hypothesis>, the suspect alone as well as contact, and /plan/beta.
    """

    def __init__(self, stream: Any, vehicles: int) -> None:
        self._stream = stream
        self._colors = [palette.vehicle_color(k) for k in range(vehicles)]
        self._request = "plan/0"
        self._told_steps: dict[str, int] = {}
        self._drawn: dict[str, Sequence[str]] = {}  # plan, and the phases it is shown in
        self._reports_m: Array | None = None  # of the experiment drawn last

    def progress(self, progress: PlanProgress) -> None:
        """A curve as it grows, over time and over steps."""
        self._request = f"{progress.kind}/{progress.number}"
        path = f"/learning/{self._request}/attempt_{progress.attempt}"
        if path not in self._told_steps:
            self._style(path, progress.attempt, "running", palette.RUNNING)
        self._told_steps[path] = progress.timesteps
        self._stream.set_time(col.TRAINING_STEPS, sequence=progress.timesteps)
        self._stream.log(path, rr.Scalars(progress.mean_reward))
        self._stream.disable_timeline(col.TRAINING_STEPS)

    def training(self, training: Training) -> None:
        """A whole curve, over steps, in the colour of what became of it."""
        place = f"{self._request}/attempt_{training.attempt}"
        outcome = "accepted" if training.accepted else "rejected"
        color = palette.ACCEPTED if training.accepted else palette.REJECTED
        path = f"/learning/{place}"
        self._style(path, training.attempt, f"{training.planner}, {outcome}", color)
        if not training.curve:
            return
        steps, rewards = np.array(training.curve, dtype=np.float64).T
        if (new := steps > self._told_steps.get(path, -1)).any():
            index = rr.TimeColumn(col.TRAINING_STEPS, sequence=steps[new].astype(np.int64))
            values = rr.Scalars.columns(scalars=rewards[new])
            self._stream.send_columns(path, indexes=[index], columns=values)
        widths = np.diff(steps, prepend=0.0)
        bars = rr.BarChart(rewards, abscissa=steps - widths / 2, widths=widths, color=color)
        self._stream.log(f"/curves/{outcome}/{place}", bars)

    def plan(self, ready: PlanReady) -> None:
        """The trainings behind a plan, and plan beta."""
        self._request = f"{ready.kind}/{ready.number}"
        for training in ready.trainings:
            self.training(training)
        if ready.predicted_m is not None:
            self._draw_beta(ready.predicted_m)

    def phase(self, phase: str) -> None:
        """A plan that is over is taken off the plane."""
        self._wipe([path for path, phases in self._drawn.items() if phase not in phases])

    def experiment(self, foreseen: Foreseen | None) -> None:
        """What each twin expects to be reported; drawn once, instead of the experiment before."""
        if foreseen is None or foreseen.reports_m is self._reports_m:
            return
        self._reports_m = foreseen.reports_m
        new = {f"/plan/alpha/{name}" for name in foreseen.hypotheses}
        self._wipe([p for p in self._drawn if p.startswith("/plan/alpha/") and p not in new])
        pairs = zip(foreseen.hypotheses, foreseen.reports_m, strict=True)
        for k, (name, report_m) in enumerate(pairs):
            strips = _strips(report_m, scene.PLAN_Z_M + LAYER_M * k)
            color = palette.hypothesis_color(name)
            path = f"/plan/alpha/{name}"
            self._stream.log(path, rr.LineStrips3D(strips, colors=color, radii=0.02))
            self._drawn[path] = ALPHA_SHOWN_IN

    def _wipe(self, paths: Sequence[str]) -> None:
        for path in paths:
            self._stream.log(path, rr.LineStrips3D([]))
            del self._drawn[path]

    def _draw_beta(self, predicted_m: Array) -> None:
        """Where the believed twin goes under the policy, in the colours of the vehicles."""
        strips = _strips(predicted_m, scene.PLAN_Z_M)
        self._stream.log("/plan/beta", rr.LineStrips3D(strips, colors=self._colors, radii=0.015))
        self._drawn["/plan/beta"] = BETA_SHOWN_IN

    def _style(self, path: str, attempt: int, outcome: str, color: palette.Rgb) -> None:
        name = f"attempt {attempt + 1}: {outcome}"
        style = rr.SeriesLines(names=name, colors=color, widths=2.0)
        self._stream.log(path, style, static=True)


def _strips(places_m: Array, z_m: float) -> list[list[scene.Point3]]:
    """A line per vehicle, of places [K, V, 2] (north, east)."""
    paths_m = places_m.transpose(1, 0, 2).tolist()
    return [[scene.at(north, east, z_m) for north, east in path] for path in paths_m]
