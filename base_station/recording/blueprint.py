"""The tabs a person sees: one per phase of the run, plus map and log. Units are in the titles."""

from collections.abc import Iterable, Sequence
from typing import Any

import rerun.blueprint as rrb

from base_station.belief.hypotheses import UNKNOWN
from base_station.recording.columns import SIM_TIME, WALL_TIME
from base_station.recording.legend import MARGIN
from base_station.recording.scene import TWIN_TRAILS, hypotheses
from hil.scenario import Arena, StationView

TABS = ("Overview", "Diagnosis", "Learning", "Mission", "Map", "Log")
REALITY = ("/plane/**", "/fleet", "/trail", "/setpoint", "/truth/**")
TWINS, PLAN, ALPHA, BETA = "/twins/**", "/plan/**", "/plan/alpha/**", "/plan/beta"
PREDICTED = ("/plane/**", "- /plane/legend/**", "/fleet", PLAN)
DARK, GRID = (14, 16, 20), (255, 255, 255, 12)
SHORT_S, CLOSE_TRAIL_S, TUBE_S, CONTACT_S, WHOLE_S = 15.0, 5.0, 1.5, 3.0, 24 * 3600.0
EYE_HEIGHTS = 1.04  # height of the eye, over the side of what it sees
ASPECT = 1.7  # width of a view of the plane, over its height
MOTOR_TABS = 6  # vehicles whose motors get a plot


def blueprint(view: StationView) -> Any:
    """The whole layout."""
    return rrb.Blueprint(
        rrb.Tabs(
            _overview(view),
            _diagnosis(view),
            _learning(view),
            _mission(view),
            _map(view),
            _log(),
            active_tab=0,
        ),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=SIM_TIME),
        auto_views=False,
    )


def _overview(view: StationView) -> Any:
    plane = _plane(view, "Plane", (*REALITY, TWINS), SHORT_S, aspect=2.0)
    left = rrb.Vertical(plane, _phases(), row_shares=[5, 3])
    right = rrb.Vertical(_close_up(view), _posterior(), _alarms(), row_shares=[11, 7, 6])
    return rrb.Horizontal(left, right, column_shares=[4, 3], name="Overview")


def _diagnosis(view: StationView) -> Any:
    left = rrb.Vertical(_close_up(view, ALPHA), _phases(), row_shares=[5, 3])
    right = rrb.Vertical(
        _posterior(legend=True),
        _plot("Evidence lost to the best (nats; -4.6 is 1 : 100)", "/belief/behind_best"),
        rrb.Horizontal(_alarm("north"), _alarm("east")),
        rrb.Horizontal(_residual("north"), _residual("east")),
        row_shares=[4, 3, 2, 2],
    )
    return rrb.Horizontal(left, right, name="Diagnosis")


def _learning(view: StationView) -> Any:
    over_time = rrb.Vertical(*(_curves(kind) for kind in ("alpha", "beta")))
    over_steps = rrb.Vertical(*(_bars(kind) for kind in ("alpha", "beta")))
    plan = _plane(view, "Plan, as predicted", PREDICTED, aspect=0.8)
    return rrb.Horizontal(over_time, over_steps, plan, column_shares=[1, 1, 1.3], name="Learning")


def _mission(view: StationView) -> Any:
    plane = _plane(view, "Mission", (*REALITY, BETA), WHOLE_S)
    motors = [
        _plot(f"Motors {m.name} (-1 to 1)", f"/motors/{m.name}", legend=True)
        for m in view.fleet[:MOTOR_TABS]
    ]
    right = rrb.Vertical(
        _plot("Distance to goal, as reported (m)", "/goal_distance/**", legend=True),
        _plot("Speed, as reported (m/s)", "/speed"),
        rrb.Tabs(*motors, _plot("Battery (%)", "/battery"), _plot("GPS satellites", "/satellites")),
        row_shares=[4, 3, 4],
    )
    left = rrb.Vertical(plane, _phases(), row_shares=[5, 3])
    return rrb.Horizontal(left, right, name="Mission")


def _map(view: StationView) -> Any:
    plane = _plane(view, "Plane", REALITY, WHOLE_S, aspect=1.0)
    title = "Map, WGS84 (tiles need the Internet)"
    return rrb.Horizontal(rrb.MapView(origin="/map", name=title), plane, name="Map")


def _log() -> Any:
    brief = rrb.TextDocumentView(origin="/brief", name="Verdict, legend, versions")
    return rrb.Horizontal(brief, _events(), name="Log")


def _plane(
    view: StationView,
    name: str,
    contents: Sequence[str],
    trail_s: float = 0.0,
    aspect: float = ASPECT,
) -> Any:
    eye = _eye(view.arena, aspect, margins=0.0 if contents is PREDICTED else MARGIN)
    title = f"{name} (seen from above, north up, 1 m grid)"
    return _space(view, title, contents, eye, trail_s)


def _close_up(view: StationView, *also: str) -> Any:
    """Follows the suspect: here one sees contacts, and twins part."""
    contents = (*REALITY, "- /plane/legend/**", TWINS, "/focus", *also)
    eye = rrb.EyeControls3D(tracking_entity="/focus")
    return _space(view, "Close up, on the suspect (1 m grid)", contents, eye, CLOSE_TRAIL_S)


def _space(view: StationView, title: str, contents: Sequence[str], eye: Any, trail_s: float) -> Any:
    shown_s = {"/trail": trail_s, "/truth/trail": trail_s}
    if TWINS in contents:
        shown_s[TWIN_TRAILS] = trail_s
    if "/focus" in contents:  # too small to be seen from afar
        twins = [h for h in hypotheses(view) if h != UNKNOWN]
        shown_s |= {f"/twins/{h}/report": TUBE_S for h in twins}
    shown_s["/truth/contacts"] = max(CONTACT_S, trail_s if trail_s == WHOLE_S else 0.0)
    return rrb.Spatial3DView(
        origin="/",
        contents=list(contents),
        name=title,
        background=DARK,
        line_grid=rrb.LineGrid3D(visible=True, spacing=1.0, stroke_width=1.0, color=GRID),
        eye_controls=eye,
        overrides={path: _last(seconds) for path, seconds in shown_s.items()},
    )


def _eye(arena: Arena, aspect: float, margins: float) -> Any:
    east_m = (arena.east_min_m + arena.east_max_m) / 2
    north_m = (arena.north_min_m + arena.north_max_m) / 2
    width_m = (1.1 + 3.6 * margins) * (arena.east_max_m - arena.east_min_m)
    side_m = max(arena.north_max_m - arena.north_min_m, width_m / aspect)
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=(east_m, north_m, EYE_HEIGHTS * side_m),
        look_target=(east_m, north_m, 0.0),
        eye_up=(0.0, 1.0, 0.0),
    )


def _last(seconds: float) -> Any:
    start = rrb.TimeRangeBoundary.cursor_relative(seconds=-seconds)
    end = rrb.TimeRangeBoundary.cursor_relative(seconds=0.0)
    return rrb.VisibleTimeRanges(
        [rrb.VisibleTimeRange(timeline, start=start, end=end) for timeline in (SIM_TIME, WALL_TIME)]
    )


def _posterior(legend: bool = False) -> Any:
    name = "What is wrong? Posterior probability"
    return _plot(name, "/belief/posterior/**", legend=legend, y=(-0.05, 1.05))


def _alarm(axis: str) -> Any:
    return _plot(f"Alarm statistic {axis} (σ)", (f"/alarm/{axis}", "/alarm/threshold"))


def _alarms() -> Any:
    return _plot("Alarm statistic, north and east (σ)", "/alarm/**")


def _residual(axis: str) -> Any:
    return _plot(f"Residual {axis} (σ)", f"/residual/{axis}")


def _curves(kind: str) -> Any:
    name, low = f"Learning {kind}: mean reward as it grew", rrb.Corner2D.RightBottom
    return _plot(name, f"/learning/{kind}/**", legend=True, corner=low)


def _bars(kind: str) -> Any:
    """Accepted and rejected attempts apart: bars hide each other."""
    views = (
        rrb.BarChartView(
            origin="/",
            contents=[f"/curves/{outcome}/{kind}/**"],
            name=f"{outcome.title()} {kind}: reward over steps",
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for outcome in ("accepted", "rejected")
    )
    return rrb.Tabs(*views)


def _phases() -> Any:
    return rrb.StateTimelineView(origin="/phase", name="Phases")


def _events() -> Any:
    columns = rrb.TextLogColumns(timeline_columns=[SIM_TIME], text_log_columns=["LogLevel", "Body"])
    contents = ["/events/**", "/truth/faults"]
    return rrb.TextLogView(origin="/", contents=contents, name="Events", columns=columns)


def _plot(
    name: str,
    paths: str | Iterable[str],
    legend: bool = False,
    y: tuple[float, float] | None = None,
    corner: rrb.Corner2D = rrb.Corner2D.RightTop,
) -> Any:
    roots = [paths] if isinstance(paths, str) else paths
    return rrb.TimeSeriesView(
        origin="/",
        contents=list(roots),
        name=name,
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=rrb.ScalarAxis(range=y) if y else None,
        plot_legend=rrb.PlotLegend(corner, visible=legend),
    )
