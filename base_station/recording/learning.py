"""Learning curves, and what each hypothesis predicts for a plan."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr

from base_station.planning.requests import OpenLoopPlan, PlanProgress, PlanReady, Training
from base_station.recording import columns as col
from base_station.recording import palette, scene

PLAN_SHOWN_IN = ("plan_alpha", "experiment", "plan_beta")
LAYER_M = 0.003  # between the lines of two hypotheses


class LearningRows:
    """Curves are /learning/<kind>/<number>/attempt_<k>; the caller has set the time."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream
        self._request = "plan/0"
        self._styled: set[str] = set()
        self._drawn: tuple[str, ...] = ()

    def progress(self, progress: PlanProgress) -> None:
        """A curve as it grows, over time."""
        self._request = f"{progress.kind}/{progress.number}"
        path = f"/learning/{self._request}/attempt_{progress.attempt}"
        if path not in self._styled:
            self._style(path, progress.attempt, "running", palette.RUNNING)
        self._stream.log(path, rr.Scalars(progress.mean_reward))

    def training(self, training: Training) -> None:
        """A whole curve, over steps, in the colour of what became of it."""
        place = f"{self._request}/attempt_{training.attempt}"
        outcome = "accepted" if training.accepted else "rejected"
        color = palette.ACCEPTED if training.accepted else palette.REJECTED
        self._style(f"/learning/{place}", training.attempt, f"{training.planner}, {outcome}", color)
        if not training.curve:
            return
        steps, rewards = np.array(training.curve, dtype=np.float64).T
        index = rr.TimeColumn(col.TRAINING_STEPS, sequence=steps.astype(np.int64))
        values = rr.Scalars.columns(scalars=rewards)
        self._stream.send_columns(f"/learning/{place}", indexes=[index], columns=values)
        widths = np.diff(steps, prepend=0.0)
        bars = rr.BarChart(rewards, abscissa=steps - widths / 2, widths=widths, color=color)
        self._stream.log(f"/curves/{outcome}/{place}", bars)

    def plan(self, ready: PlanReady, hypotheses: Sequence[str]) -> None:
        """The trainings behind a plan; `hypotheses` names the twins that predict, in order."""
        self._request = f"{ready.kind}/{ready.number}"
        for training in ready.trainings:
            self.training(training)
        if ready.plan is not None:
            self._draw(ready.plan, hypotheses)

    def phase(self, phase: str) -> None:
        """A plan that is over is taken off the plane."""
        if self._drawn and phase not in PLAN_SHOWN_IN:
            for name in self._drawn:
                self._stream.log(f"/plan/{name}", rr.LineStrips3D([]))
            self._drawn = ()

    def _draw(self, plan: OpenLoopPlan, hypotheses: Sequence[str]) -> None:
        reports_m = plan.predicted_reports
        names = tuple(hypotheses)
        if len(names) != len(reports_m):
            names = tuple(f"hypothesis_{k}" for k in range(len(reports_m)))
        for k, (name, report_m) in enumerate(zip(names, reports_m, strict=True)):
            z_m = scene.PLAN_Z_M + LAYER_M * k
            paths_m = report_m.transpose(1, 0, 2).tolist()
            strips = [[scene.at(n, e, z_m) for n, e in path] for path in paths_m]
            color = palette.hypothesis_color(name)
            self._stream.log(f"/plan/{name}", rr.LineStrips3D(strips, colors=color, radii=0.02))
        self._drawn = names

    def _style(self, path: str, attempt: int, outcome: str, color: palette.Rgb) -> None:
        self._styled.add(path)
        name = f"attempt {attempt + 1}: {outcome}"
        style = rr.SeriesLines(names=name, colors=color, widths=2.0)
        self._stream.log(path, style, static=True)
