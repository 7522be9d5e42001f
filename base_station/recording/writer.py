"""Station messages to rows of a recording."""

import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike

from base_station.planning.requests import PlanProgress, PlanReady, Training
from base_station.recording import columns as col
from base_station.recording import palette, scene
from base_station.recording.brief import Brief
from base_station.recording.trails import Trails
from base_station.records import Event, EventKind, Snapshot, TwinSnapshot, VehicleSnapshot
from hil.frames import ned_to_wgs84
from hil.scenario import StationView

LEVELS: dict[EventKind, str] = {"anomaly": "WARN", "takeover": "WARN", "command": "WARN"}
SLOW_S = 1.0  # between rows of what hardly changes
UNKNOWN = "unknown"
REPORT_SIGMAS = 2.0
MIN_REPORT_M = 0.03  # half size at which a certain prediction is still seen
FLOOR_NATS = -50.0  # e^-50: how far behind the best stops to matter
PLAN_SHOWN_IN = ("plan_alpha", "experiment")


class Writer:
    """Writes one stream, from one thread. Errors of the recording library come through."""

    def __init__(self, stream: Any, run_id: str, view: StationView, period_s: float) -> None:
        self._stream, self._view = stream, view
        self._batch = col.Batch(stream, period_s)
        self._members = {m.sysid: m for m in view.fleet}
        self._origin = view.origin.origin()
        self._now_s, self._slow_s = 0.0, -math.inf
        self._states: dict[str, str] = {}
        self._shown: set[str] = set()  # entities that need a clearing row when their thing is gone
        self._styled: set[str] = set()
        self._planned: tuple[str, ...] = ()
        self._twins: tuple[str, ...] = ()
        self._trails = Trails()
        self._curve_of = "plan"
        scene.log_scene(stream, view)
        self._brief = Brief(run_id, view)
        self._write_brief(0.0)

    def snapshot(self, snapshot: Snapshot) -> None:
        """The station's belief at one instant."""
        self._now_s = snapshot.time_s
        self._batch.tick(snapshot.time_s)
        slow = snapshot.time_s - self._slow_s >= SLOW_S
        if slow:
            self._slow_s = snapshot.time_s
        for vehicle in snapshot.vehicles:
            self._vehicle(vehicle, slow)
        self._scalar("/alarm/threshold", snapshot.threshold)
        self._scalar("/goal_distance/radius", self._view.limits.goal_radius_m)
        self._belief(snapshot.twins)
        self._state("fleet", snapshot.phase)
        if self._planned and snapshot.phase not in PLAN_SHOWN_IN:
            self._draw_plan({name: [] for name in self._planned})
            self._planned = ()

    def event(self, event: Event) -> None:
        """One line of the log; verdict and end also rewrite the brief."""
        self._set_time(event.time_s)
        level = LEVELS.get(event.kind, "INFO")
        self._stream.log(f"/events/{event.kind}", rr.TextLog(event.text, level=level))
        if self._brief.hear(event):
            self._write_brief(event.time_s)

    def progress(self, progress: PlanProgress) -> None:
        """A learning curve as it grows, over sim_time and wall time."""
        self._curve_of = f"{progress.kind}_{progress.number}"
        path = f"/learning/{self._curve_of}/attempt_{progress.attempt}"
        if path not in self._styled:
            self._style_curve(path, progress.attempt, "running", palette.RUNNING)
        self._set_time(self._now_s)
        self._stream.log(path, rr.Scalars(progress.mean_reward))

    def training(self, training: Training) -> None:
        """A whole learning curve, over training steps, in the colour of what became of it."""
        path = f"/learning/{self._curve_of}/attempt_{training.attempt}"
        outcome = "accepted" if training.accepted else "rejected"
        color = palette.ACCEPTED if training.accepted else palette.REJECTED
        self._style_curve(path, training.attempt, f"{training.planner}, {outcome}", color)
        if training.curve:
            steps, rewards = np.array(training.curve).T
            index = rr.TimeColumn(col.TRAINING_STEPS, sequence=steps.astype(np.int64))
            values = rr.Scalars.columns(scalars=rewards)
            self._stream.send_columns(path, indexes=[index], columns=values)

    def plan(self, ready: PlanReady) -> None:
        """The trainings behind a plan, and what each hypothesis predicts for plan alpha."""
        self._curve_of = f"{ready.kind}_{ready.number}"
        for training in ready.trainings:
            self.training(training)
        if ready.plan is None:
            return
        reports = ready.plan.predicted_reports
        names = self._twins
        if len(names) != len(reports):
            names = tuple(f"hypothesis_{k}" for k in range(len(reports)))
        self._planned = names
        moved = {n: r.transpose(1, 0, 2) for n, r in zip(names, reports, strict=True)}
        self._draw_plan(moved)

    def close(self) -> None:
        """Everything kept back goes out, and the stream ends."""
        self._batch.send()
        self._stream.disconnect()

    def _vehicle(self, vehicle: VehicleSnapshot, slow: bool) -> None:
        name, (north_m, east_m) = vehicle.name, vehicle.reported_m
        for axis, residual, level in zip(
            ("north", "east"), vehicle.residual, vehicle.cusum, strict=True
        ):
            self._scalar(f"/residual/{axis}/{name}", residual)
            self._scalar(f"/alarm/{axis}/{name}", level)
        self._scalar(f"/speed/{name}", math.hypot(*vehicle.velocity_mps))
        if vehicle.motor_outputs and _known(*vehicle.motor_outputs):
            self._batch.add(f"/motors/{name}", col.SCALARS, vehicle.motor_outputs)
        self._state(name, vehicle.phase)
        if slow:
            self._scalar(f"/battery/{name}", vehicle.battery_percent)
            self._scalar(f"/satellites/{name}", vehicle.gps_satellites)
        if not _known(north_m, east_m):
            return
        yaw_rad = vehicle.yaw_rad if _known(vehicle.yaw_rad) else 0.0
        self._batch.add(f"/fleet/{name}", col.POSES, (east_m, north_m, yaw_rad))
        if step := self._trails.step(name, scene.at(north_m, east_m, scene.TRAIL_Z_M)):
            self._batch.add(f"/trail/{name}", col.SEGMENTS, step)
        self._setpoint(vehicle)
        goal = self._members[vehicle.sysid].goal
        away_m = math.hypot(goal.north_m - north_m, goal.east_m - east_m)
        self._scalar(f"/goal_distance/{name}", away_m)
        if slow:
            self._batch.add(
                f"/map/{name}", col.GEO_POINTS, ned_to_wgs84(north_m, east_m, self._origin)
            )

    def _setpoint(self, vehicle: VehicleSnapshot) -> None:
        path, setpoint = f"/setpoint/{vehicle.name}", vehicle.setpoint_mps
        if setpoint is None or not any(setpoint) or not _known(*setpoint):
            self._clear(path, col.ARROWS)
            return
        origin = scene.at(*vehicle.reported_m, scene.ARROW_Z_M)
        self._show(path, col.ARROWS, (*origin, *scene.at(*setpoint)))

    def _belief(self, twins: Sequence[TwinSnapshot]) -> None:
        names = tuple(t.hypothesis for t in twins)
        for gone in set(self._twins) - set(names):
            self._clear(f"/twins/{gone}/body", col.DISCS)
            self._clear(f"/twins/{gone}/report", col.ELLIPSES)
            self._trails.forget(gone)
        self._twins = names
        if not twins:
            return
        best = max(t.log_likelihood for t in twins)
        for twin in twins:
            self._twin(twin)
            self._scalar(f"/belief/posterior/{twin.hypothesis}", twin.posterior)
            self._scalar(f"/belief/log_likelihood/{twin.hypothesis}", twin.log_likelihood)
            behind = max(FLOOR_NATS, twin.log_likelihood - best)
            self._scalar(f"/belief/behind_best/{twin.hypothesis}", behind)
        if len(twins) > 1 and UNKNOWN not in names:  # it has no twin; the rest is its share
            self._style_twin(UNKNOWN)
            rest = max(0.0, 1.0 - sum(t.posterior for t in twins))
            self._scalar(f"/belief/posterior/{UNKNOWN}", rest)

    def _twin(self, twin: TwinSnapshot) -> None:
        name, root = twin.hypothesis, f"/twins/{twin.hypothesis}"
        self._style_twin(name)
        if not (np.isfinite(twin.true_m).all() and np.isfinite(twin.report_m).all()):
            return
        bodies = [scene.at(n, e, scene.TWIN_Z_M) for n, e in twin.true_m.tolist()]
        self._show(f"{root}/body", col.DISCS, bodies)
        half_m = np.maximum(REPORT_SIGMAS * np.nan_to_num(twin.sigma_m), MIN_REPORT_M).tolist()
        spots = [
            (*scene.at(n, e, scene.REPORT_Z_M), *scene.at(sn, se, 0.002))
            for (n, e), (sn, se) in zip(twin.report_m.tolist(), half_m, strict=True)
        ]
        self._show(f"{root}/report", col.ELLIPSES, spots)
        steps = [self._trails.step((name, k), body) for k, body in enumerate(bodies)]
        if moved := [step for step in steps if step]:
            self._batch.add(f"{root}/trail", col.SEGMENTS, moved)

    def _draw_plan(self, paths_m: dict[str, Any]) -> None:
        """`paths_m`: per hypothesis [V, K + 1, 2], north and east; an empty one clears."""
        self._set_time(self._now_s)
        for name, path_m in paths_m.items():
            strips = [[scene.at(n, e, scene.PLAN_Z_M) for n, e in strip] for strip in path_m]
            color = palette.hypothesis_color(name)
            self._stream.log(f"/plan/{name}", rr.LineStrips3D(strips, colors=color, radii=0.02))

    def _style_twin(self, name: str) -> None:
        if name not in self._styled:
            self._styled.add(name)
            scene.style_twin(self._stream, name, [m.frame.radius_m for m in self._view.fleet])

    def _style_curve(self, path: str, attempt: int, outcome: str, color: palette.Rgb) -> None:
        self._styled.add(path)
        name = f"{self._curve_of.replace('_', ' ')}, attempt {attempt + 1}: {outcome}"
        style = rr.SeriesLines(names=name, colors=color, widths=2.0)
        self._stream.log(path, style, static=True)

    def _scalar(self, path: str, value: float) -> None:
        if math.isfinite(value):
            self._batch.add(path, col.SCALARS, value)

    def _show(self, path: str, kind: col.Kind, row: ArrayLike) -> None:
        self._shown.add(path)
        self._batch.add(path, kind, row)

    def _clear(self, path: str, kind: col.Kind) -> None:
        if path in self._shown:
            self._shown.remove(path)
            self._batch.add(path, kind, ())

    def _state(self, who: str, state: str) -> None:
        if self._states.get(who) != state:
            self._states[who] = state
            self._set_time(self._now_s)
            self._stream.log(f"/phase/{who}", rr.StateChange(state=state))

    def _write_brief(self, time_s: float) -> None:
        self._set_time(time_s)
        page = rr.TextDocument(self._brief.markdown(), media_type=rr.MediaType.MARKDOWN)
        self._stream.log("/brief", page)

    def _set_time(self, time_s: float) -> None:
        self._stream.set_time(col.SIM_TIME, duration=time_s)
        self._stream.set_time(col.WALL_TIME, timestamp=time.time())


def _known(*values: float) -> bool:
    return all(map(math.isfinite, values))
