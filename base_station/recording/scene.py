"""What never changes: arena, goals, legend, and the looks of every entity.

Space is east (x), north (y), up (z) in metres, so that north is up when seen from above; layers
lie a few centimetres above each other.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import rerun as rr

from base_station.belief.hypotheses import NONE, candidates
from base_station.recording.columns import RING_M
from base_station.recording.palette import (
    BLACK,
    DIM,
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
from hil.faults import Type
from hil.frames import ned_to_wgs84
from hil.scenario import Obstacle, Rectangle, StationView

GROUND_Z_M, TRUTH_Z_M, TWIN_Z_M, REPORT_Z_M, PLAN_Z_M, ARROW_Z_M = 0.0, 0.03, 0.05, 0.06, 0.07, 0.1
DISC_M = 0.02  # height
DASH_M = 0.2
NOSE_AT, NOSE_M = 0.7, 0.05  # of a body's radius from its middle; radius
CLOSE_M, CLOSE_FOV_RAD = 3.4, 0.96  # the camera of the close-up: height above the plane, opening
PER_VEHICLE = (
    *("residual/north", "residual/east", "alarm/north", "alarm/east"),
    *("speed", "goal_distance", "battery", "satellites"),
)
PER_HYPOTHESIS = ("log_likelihood", "behind_best")
TWIN_TRAILS = "/twins/trail"  # of all: a time range of its own for each would cost 3 kB a view
Point3 = tuple[float, float, float]


def hypotheses(view: StationView) -> tuple[str, ...]:
    """Every hypothesis that any vehicle of the fleet could be under, in a fixed order."""
    names = [h.name for m in view.fleet for h in candidates(m, view.diagnosis.priors)]
    return tuple(dict.fromkeys(names))


def usual(view: StationView) -> tuple[str, ...]:
    """Those of them that a legend has room for: dead motors, a stuck GPS, nothing wrong."""
    likely = {
        h.name
        for m in view.fleet
        for h in candidates(m, view.diagnosis.priors)
        if h.name == NONE or (h.fault and h.fault.type in (Type.OFF, Type.STUCK))
    }
    return tuple(name for name in hypotheses(view) if name in likely)


def at(north_m: float, east_m: float, z_m: float = 0.0) -> Point3:
    """A place in space as it is logged."""
    return east_m, north_m, z_m


def circle(north_m: float, east_m: float, radius_m: float, z_m: float) -> list[Point3]:
    """A closed line."""
    turns = [2.0 * math.pi * k / 32 for k in range(33)]
    return [
        at(north_m + radius_m * math.cos(a), east_m + radius_m * math.sin(a), z_m) for a in turns
    ]


def _rim(obstacle: Obstacle) -> list[Point3]:
    """A closed line: half a circle around each end."""
    a, b = obstacle.ends
    first = math.atan2(b.east_m - a.east_m, b.north_m - a.north_m) - 0.5 * math.pi
    ring = [
        at(
            p.north_m + obstacle.radius_m * math.cos(first + turn),
            p.east_m + obstacle.radius_m * math.sin(first + turn),
        )
        for p, half in ((b, range(17)), (a, range(16, 33)))
        for turn in (math.pi * k / 16 for k in half)
    ]
    return [*ring, ring[0]]


def log_scene(stream: Any, view: StationView) -> None:
    """Everything that is known before the first message."""
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    outline = rr.LineStrips3D([_outline(view.arena)], colors=DIM, radii=0.02)
    stream.log("/plane/arena", outline, static=True)
    if view.obstacles:
        rims = rr.LineStrips3D([_rim(o) for o in view.obstacles], colors=DIM, radii=0.02)
        stream.log("/plane/obstacles", rims, static=True)
    if view.geofence:
        dashes = rr.LineStrips3D(_dashes(view.geofence), colors=LIGHT_GREY, radii=0.015)
        stream.log("/plane/geofence", dashes, static=True)
    _log_goals(stream, view)
    _style_fleet(stream, view)
    style_belief(stream, hypotheses(view))
    stream.log("/alarm/threshold", _lines(["alarm threshold"], [THRESHOLD], 1.0), static=True)
    reached = _lines(["counts as reached"], [THRESHOLD], 1.0)
    stream.log("/goal_distance/radius", reached, static=True)
    for name in ("fleet", *(m.name for m in view.fleet)):
        stream.log(f"/phase/{name}", _states(), static=True)
    _log_map(stream, view)


def style_bodies(
    stream: Any, path: str, radii_m: Sequence[float], colors: Any, solid: bool
) -> None:
    """Discs or rings, one a vehicle, with a nose."""
    looks = rr.Cylinders3D.from_fields(
        radii=radii_m,
        lengths=DISC_M if solid else RING_M,
        colors=colors,
        fill_mode="solid" if solid else "majorwireframe",
        line_radii=0.02,
    )
    stream.log(path, looks, static=True)
    nose = rr.Points3D.from_fields(colors=BLACK if solid else colors, radii=NOSE_M)
    stream.log(path, nose, static=True)


def style_belief(stream: Any, names: Sequence[str]) -> None:
    """A line per hypothesis, in the order of the values."""
    lines = _lines(names, [hypothesis_color(name) for name in names], 2.0)
    for quantity in PER_HYPOTHESIS:
        stream.log(f"/belief/{quantity}", lines, static=True)


def style_posterior(stream: Any, path: str, name: str) -> None:
    """The line of one hypothesis."""
    stream.log(path, _lines([name], [hypothesis_color(name)], 2.0), static=True)


def style_twin(stream: Any, name: str) -> None:
    """Rings where the fleet would be, spots where it would report to be."""
    color, root = hypothesis_color(name), f"/twins/{name}"
    ring = rr.Cylinders3D.from_fields(colors=color, fill_mode="majorwireframe", line_radii=0.02)
    stream.log(f"{root}/body", ring, static=True)
    spot = rr.Ellipsoids3D.from_fields(colors=color, fill_mode="majorwireframe", line_radii=0.01)
    stream.log(f"{root}/report", spot, static=True)


def _style_fleet(stream: Any, view: StationView) -> None:
    names = [m.name for m in view.fleet]
    colors = [vehicle_color(k) for k in range(len(names))]
    radii_m = [m.frame.radius_m for m in view.fleet]
    style_bodies(stream, "/fleet", radii_m, colors, solid=True)
    stream.log("/setpoint", rr.Arrows3D.from_fields(colors=WHITE, radii=0.03), static=True)
    for trail in ("/trail", TWIN_TRAILS):
        stream.log(trail, rr.LineStrips3D.from_fields(radii=0.02), static=True)
    _log_camera(stream)
    stream.log("/map/fleet", rr.GeoPoints.from_fields(colors=colors, radii=-5.0), static=True)
    for quantity in PER_VEHICLE:
        stream.log(f"/{quantity}", _lines(names, colors, 1.5), static=True)
    for member in view.fleet:
        stream.log(f"/motors/{member.name}", _motor_lines(member.frame), static=True)


def _log_camera(stream: Any) -> None:
    """Looks down on whatever a close-up follows, north up."""
    view = rr.Pinhole(
        fov_y=CLOSE_FOV_RAD, aspect_ratio=1.6, image_plane_distance=0.01, color=(0, 0, 0, 0)
    )
    stream.log("/focus", view, static=True)


def _log_goals(stream: Any, view: StationView) -> None:
    goals = [m.goal for m in view.fleet]
    colors = [vehicle_color(k) for k in range(len(goals))]
    radius_m = view.limits.goal_radius_m
    rings = [circle(g.north_m, g.east_m, radius_m, GROUND_Z_M) for g in goals]
    stream.log("/plane/goals", rr.LineStrips3D(rings, colors=colors, radii=0.02), static=True)
    places = [at(g.north_m, g.east_m) for g in goals]
    labels = [f"goal of {m.name}" for m in view.fleet]
    dots = rr.Points3D(places, colors=colors, radii=0.06, labels=labels, show_labels=False)
    stream.log("/plane/goals", dots, static=True)


def _log_map(stream: Any, view: StationView) -> None:
    origin = view.origin.origin()
    goals = [ned_to_wgs84(m.goal.north_m, m.goal.east_m, origin) for m in view.fleet]
    colors = [mix(vehicle_color(k), BLACK, 0.5) for k in range(len(goals))]
    outline = [ned_to_wgs84(north, east, origin) for east, north, _ in _outline(view.arena)]
    stream.log("/map/goals", rr.GeoPoints(lat_lon=goals, colors=colors, radii=-9.0), static=True)
    lines = rr.GeoLineStrings(lat_lon=[outline], colors=LIGHT_GREY, radii=-1.0)
    stream.log("/map/arena", lines, static=True)
    if view.geofence:
        fence = [
            [ned_to_wgs84(north, east, origin) for east, north, _ in dash]
            for dash in _dashes(view.geofence)
        ]
        dashed = rr.GeoLineStrings(lat_lon=fence, colors=LIGHT_GREY, radii=-1.0)
        stream.log("/map/geofence", dashed, static=True)


def _dashes(area: Rectangle) -> list[list[Point3]]:
    """Its outline in dashes of `DASH_M`, with gaps as long."""
    dashes = []
    for (east, north, z_m), (east_end, north_end, _) in pairwise(_outline(area)):
        count = max(1, round(math.hypot(east_end - east, north_end - north) / DASH_M / 2))
        for k in range(count):
            shares = (k / count, (k + 0.5) / count)
            dashes.append(
                [
                    at(north + s * (north_end - north), east + s * (east_end - east), z_m)
                    for s in shares
                ]
            )
    return dashes


def _outline(area: Rectangle) -> list[Point3]:
    north, east = (area.north_min_m, area.north_max_m), (area.east_min_m, area.east_max_m)
    corners = ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))
    return [at(north[n], east[e]) for n, e in corners]


def _motor_lines(frame: Airframe) -> Any:
    """Motors have the colour of the hypothesis that says they are dead."""
    axes = {i: axis for axis in ("x", "y") for i in frame.axis_motors(axis)}
    motors = range(1, len(frame.motors) + 1)
    return rr.SeriesLines(
        names=[f"motor {i} (body {axes.get(i, '?')})" for i in motors],
        colors=[hypothesis_color(f"motor_{axes.get(i)}_off") for i in motors],
        widths=[3.0 - 1.5 * (i % 2) for i in motors],
    )


def _lines(names: Sequence[str], colors: Sequence[Rgb], width: float) -> Any:
    return rr.SeriesLines(names=names, colors=colors, widths=[width] * len(names))


def _states() -> Any:
    names = [name for name, _ in PHASES]
    return rr.StateConfiguration(values=names, labels=names, colors=[color for _, color in PHASES])
