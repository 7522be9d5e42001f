"""The tabs a person sees: one per phase of the run, plus map and log. Units are in the titles."""

from collections.abc import Sequence
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from base_station.recording.columns import SIM_TIME
from base_station.recording.palette import hypothesis_color
from hil.scenario import Arena, StationView

TABS = ("Overview", "Diagnosis", "Learning", "Mission", "Map", "Log")
PLANE = ("/plane/**", "/fleet/**", "/trail/**", "/setpoint/**", "/truth/**")
TWINS, PLAN = ("/twins/**",), ("/plan/**",)
DARK = (14, 16, 20)
SHORT_S, CONTACT_S = 12.0, 2.0
EYE_HEIGHTS = 1.25  # height of the eye over the longer side of the arena


def blueprint(view: StationView, tab: str = TABS[0]) -> Any:
    """The whole layout, with `tab` in front. Raises ValueError for a tab that is not there."""
    tabs = (_overview, _diagnosis, _learning, _mission, _map, _log)
    return rrb.Blueprint(
        rrb.Tabs(*(make(view) for make in tabs), active_tab=TABS.index(tab)),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=SIM_TIME),
        auto_views=False,
    )


def _overview(view: StationView) -> Any:
    left = rrb.Vertical(_plane(view, "Plane", (*PLANE, *TWINS)), _phases(), row_shares=[3, 1.2])
    right = rrb.Vertical(_posterior(), _alarm("north"), _alarm("east"), _events())
    return rrb.Horizontal(left, right, column_shares=[3, 2], name="Overview")


def _diagnosis(view: StationView) -> Any:
    plane = _plane(view, "Reality and twins", (*PLANE, *TWINS, *PLAN))
    behind = _plot("How far each explanation is behind the best (nats; -4.6 is 1 : 100)", "/belief/behind_best")
    left = rrb.Vertical(plane, _phases(), row_shares=[3, 1.2])
    right = rrb.Vertical(
        _posterior(),
        behind,
        rrb.Horizontal(_alarm("north"), _alarm("east")),
        rrb.Horizontal(_residual("north"), _residual("east")),
    )
    return rrb.Horizontal(left, right, name="Diagnosis")


def _learning(view: StationView) -> Any:
    curves = _plot("Learning curves: mean reward of an episode", "/learning")
    plan = _plane(view, "Plan alpha: what each hypothesis predicts", ("/plane/**", "/fleet/**", *PLAN))
    return rrb.Horizontal(curves, plan, name="Learning")


def _mission(view: StationView) -> Any:
    plane = _plane(view, "Mission", PLANE, trail_s=None)
    motors = [_plot(f"Motor outputs of {m.name} (-1 to 1)", f"/motors/{m.name}") for m in view.fleet[:3]]
    left = rrb.Vertical(plane, _phases(), row_shares=[3, 1.2])
    right = rrb.Vertical(
        _plot("Distance to goal, as reported (m)", "/goal_distance"),
        _plot("Speed, as reported (m/s)", "/speed"),
        rrb.Tabs(*motors, _plot("Battery (%)", "/battery"), _plot("GPS satellites", "/satellites")),
    )
    return rrb.Horizontal(left, right, name="Mission")


def _map(view: StationView) -> Any:
    return rrb.MapView(origin="/map", name="Map")


def _log(view: StationView) -> Any:
    brief = rrb.TextDocumentView(origin="/brief", name="Brief: verdict, legend, versions")
    return rrb.Horizontal(brief, _events(), name="Log")


def _plane(view: StationView, name: str, contents: Sequence[str], trail_s: float | None = SHORT_S) -> Any:
    trails = ["/trail", "/truth/trail", "/twins"]
    overrides: dict[str, Any] = {path: _last(trail_s) for path in trails}
    return rrb.Spatial3DView(
        origin="/",
        contents=list(contents),
        name=f"{name} (from above, north up, 1 m grid)",
        background=DARK,
        line_grid=rrb.LineGrid3D(visible=True, spacing=1.0, stroke_width=0.5, color=(255, 255, 255, 24)),
        eye_controls=_eye(view.arena),
        overrides=overrides,
    )


def _eye(arena: Arena) -> Any:
    east_m = (arena.east_min_m + arena.east_max_m) / 2
    north_m = (arena.north_min_m + arena.north_max_m) / 2
    size_m = max(arena.north_max_m - arena.north_min_m, arena.east_max_m - arena.east_min_m)
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=(east_m, north_m, EYE_HEIGHTS * size_m),
        look_target=(east_m, north_m, 0.0),
        eye_up=(0.0, 1.0, 0.0),
    )


def _last(seconds: float | None) -> Any:
    start = (
        rrb.TimeRangeBoundary.infinite()
        if seconds is None
        else rrb.TimeRangeBoundary.cursor_relative(seconds=-seconds)
    )
    end = rrb.TimeRangeBoundary.cursor_relative(seconds=0.0)
    return rrb.VisibleTimeRanges(timeline=SIM_TIME, start=start, end=end)


def _posterior() -> Any:
    return _plot("What is wrong? Posterior probability", "/belief/posterior", y=(0.0, 1.0))


def _alarm(axis: str) -> Any:
    contents = [f"/alarm/{axis}/**", "/alarm/threshold"]
    return _plot(f"Alarm statistic, {axis} (standard deviations)", contents)


def _residual(axis: str) -> Any:
    return _plot(f"Residual, {axis} (standard deviations)", f"/residual/{axis}")


def _phases() -> Any:
    return rrb.StateTimelineView(origin="/phase", name="Phases")


def _events() -> Any:
    return rrb.TextLogView(
        origin="/events", contents=["/events/**", "/truth/faults"], name="Events"
    )


def _plot(name: str, contents: str | list[str], y: tuple[float, float] | None = None) -> Any:
    return rrb.TimeSeriesView(
        origin="/",
        contents=[f"{contents}/**"] if isinstance(contents, str) else contents,
        name=name,
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=rrb.ScalarAxis(range=y) if y else None,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
    )
