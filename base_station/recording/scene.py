"""What never changes: arena, goals, the looks of every entity, the legend. Entities are listed here.

Space is east (x), north (y), up (z) in metres, so that north is up when seen from above; layers
lie a few centimetres above each other.
"""

import math
from collections.abc import Iterable
from typing import Any

import rerun as rr

from base_station.recording.palette import (
    GREY,
    LIGHT_GREY,
    PHASES,
    THRESHOLD,
    WHITE,
    Rgb,
    hypothesis_color,
    mix,
    vehicle_color,
)
from hil.airframe import Airframe
from hil.frames import ned_to_wgs84
from hil.scenario import Arena, StationView

BLACK: Rgb = (0, 0, 0)
TRAIL_Z_M, TRUTH_Z_M, TWIN_Z_M, REPORT_Z_M, PLAN_Z_M, ARROW_Z_M = 0.01, 0.03, 0.06, 0.07, 0.08, 0.1
DISC_HEIGHT_M = 0.02
Point3 = tuple[float, float, float]


def log_scene(stream: Any, view: StationView) -> None:
    """Everything static that is known before the first message."""
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    stream.log("/plane/arena", rr.LineStrips3D([_outline(view.arena)], colors=GREY), static=True)
    _log_goals(stream, view)
    for index, member in enumerate(view.fleet):
        _style_vehicle(stream, member.name, vehicle_color(index), member.frame.radius_m)
        stream.log(f"/motors/{member.name}", _motor_lines(member.frame), static=True)
    stream.log("/alarm/threshold", _line("alarm threshold", THRESHOLD, 1.0), static=True)
    stream.log("/goal_distance/radius", _line("counts as reached", THRESHOLD, 1.0), static=True)
    for name in ("fleet", *(m.name for m in view.fleet)):
        stream.log(f"/phase/{name}", _states(), static=True)
    _log_map(stream, view)


def style_twin(stream: Any, name: str, radii_m: Iterable[float]) -> None:
    """The looks of a hypothesis: one colour in space and in plots."""
    color, root = hypothesis_color(name), f"/twins/{name}"
    ring = rr.Cylinders3D.from_fields(
        radii=list(radii_m), lengths=0.001, colors=color, fill_mode=rr.components.FillMode.MajorWireframe
    )
    stream.log(f"{root}/body", ring, static=True)
    stream.log(f"{root}/report", rr.Ellipsoids3D.from_fields(colors=color, fill_mode="solid"), static=True)
    stream.log(f"{root}/trail", rr.LineStrips3D.from_fields(colors=color, radii=0.015), static=True)
    for quantity in ("posterior", "log_likelihood", "behind_best"):
        stream.log(f"/belief/{quantity}/{name}", _line(name, color, 2.0), static=True)


def disc(radius_m: float, color: Rgb, label: str | None = None) -> Any:
    """A flat disc at the origin of its entity."""
    return rr.Cylinders3D(
        centers=(0.0, 0.0, 0.0),
        radii=radius_m,
        lengths=DISC_HEIGHT_M,
        colors=color,
        fill_mode="solid",
        labels=label,
    )


def at(north_m: float, east_m: float, z_m: float = 0.0) -> Point3:
    """A place in space as it is logged."""
    return east_m, north_m, z_m


def circle(north_m: float, east_m: float, radius_m: float, z_m: float) -> list[Point3]:
    """A closed line."""
    turns = [2.0 * math.pi * k / 32 for k in range(33)]
    return [at(north_m + radius_m * math.cos(a), east_m + radius_m * math.sin(a), z_m) for a in turns]


def _style_vehicle(stream: Any, name: str, color: Rgb, radius_m: float) -> None:
    stream.log(f"/fleet/{name}", disc(radius_m, color, name), static=True)
    nose = rr.LineStrips3D(
        [[(0.0, 0.0, DISC_HEIGHT_M), (0.0, radius_m, DISC_HEIGHT_M)]], colors=BLACK, radii=0.03
    )
    stream.log(f"/fleet/{name}/heading", nose, static=True)
    stream.log(f"/setpoint/{name}", rr.Arrows3D.from_fields(colors=WHITE, radii=0.03), static=True)
    stream.log(f"/trail/{name}", rr.LineStrips3D.from_fields(colors=color, radii=0.02), static=True)
    stream.log(f"/map/{name}", rr.GeoPoints.from_fields(colors=color, radii=-4.0), static=True)
    for quantity in ("residual/north", "residual/east", "alarm/north", "alarm/east"):
        stream.log(f"/{quantity}/{name}", _line(name, color, 1.5), static=True)
    for quantity in ("speed", "goal_distance", "battery", "satellites"):
        stream.log(f"/{quantity}/{name}", _line(name, color, 1.5), static=True)


def _log_goals(stream: Any, view: StationView) -> None:
    radius_m = view.limits.goal_radius_m
    goals = [m.goal for m in view.fleet]
    colors = [vehicle_color(i) for i in range(len(goals))]
    rings = [circle(g.north_m, g.east_m, radius_m, TRAIL_Z_M) for g in goals]
    stream.log("/plane/goals", rr.LineStrips3D(rings, colors=colors, radii=0.02), static=True)
    centres = rr.Points3D(
        [at(g.north_m, g.east_m, TRAIL_Z_M) for g in goals],
        colors=[mix(c, BLACK, 0.3) for c in colors],
        radii=0.05,
        labels=[f"goal of {m.name}" for m in view.fleet],
    )
    stream.log("/plane/goals/centre", centres, static=True)


def _log_map(stream: Any, view: StationView) -> None:
    origin = view.origin.origin()
    goals = [ned_to_wgs84(m.goal.north_m, m.goal.east_m, origin) for m in view.fleet]
    colors = [mix(vehicle_color(i), BLACK, 0.4) for i in range(len(goals))]
    outline = [ned_to_wgs84(north, east, origin) for east, north, _ in _outline(view.arena)]
    stream.log("/map/goals", rr.GeoPoints(lat_lon=goals, colors=colors, radii=-6.0), static=True)
    stream.log("/map/arena", rr.GeoLineStrings(lat_lon=[outline], colors=LIGHT_GREY), static=True)


def _outline(arena: Arena) -> list[Point3]:
    north, east = (arena.north_min_m, arena.north_max_m), (arena.east_min_m, arena.east_max_m)
    corners = ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))
    return [at(north[n], east[e]) for n, e in corners]


def _motor_lines(frame: Airframe) -> Any:
    """Motors have the colour of the hypothesis that says they are dead."""
    axes = {i: axis for axis in ("x", "y") for i in frame.axis_motors(axis)}
    motors = range(1, len(frame.motors) + 1)
    return rr.SeriesLines(
        names=[f"motor {i} (body {axes.get(i, '?')})" for i in motors],
        colors=[hypothesis_color(f"motor_{axes.get(i)}_off") for i in motors],
        widths=[1.0 + (i % 2) for i in motors],
    )


def _line(name: str, color: Rgb, width: float) -> Any:
    return rr.SeriesLines(names=name, colors=color, widths=width)


def _states() -> Any:
    names = [name for name, _ in PHASES]
    return rr.StateConfiguration(values=names, labels=names, colors=[color for _, color in PHASES])
