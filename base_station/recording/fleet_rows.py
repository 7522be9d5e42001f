"""The vehicles as the station sees them, tick by tick."""

import math
from collections.abc import Callable, Sequence

from base_station.recording import columns as col
from base_station.recording import scene
from base_station.recording.palette import vehicle_color
from base_station.recording.trails import Trails
from base_station.records import Snapshot, VehicleSnapshot
from hil.frames import body_to_ned, ned_to_wgs84
from hil.scenario import StationView

LINE_S = 0.2  # between rows of what is only drawn as a line
SLOW_S = 1.0  # between rows of what hardly changes
EARLY_S = 1e-6
AHEAD_S = 2.0  # a set-point is drawn as the way it leads in this time


class FleetRows:
    """Series of the whole fleet are one entity each, vehicles in fleet order: cheap to write."""

    def __init__(self, batch: col.Batch, view: StationView) -> None:
        self._batch, self._goals = batch, {m.sysid: m.goal for m in view.fleet}
        self._radii_m = {m.sysid: m.frame.radius_m for m in view.fleet}
        self._reached_m = view.limits.goal_radius_m
        self._origin = view.origin.origin()
        self._trails = Trails()
        self._line_s = self._slow_s = -math.inf
        self._driven = False
        self._suspect: int | None = None

    def add(self, snapshot: Snapshot) -> None:
        vehicles = snapshot.vehicles
        self._series("residual/north", vehicles, lambda v: v.residual[0])
        self._series("residual/east", vehicles, lambda v: v.residual[1])
        self._series("alarm/north", vehicles, lambda v: v.cusum[0])
        self._series("alarm/east", vehicles, lambda v: v.cusum[1])
        if snapshot.time_s - self._line_s >= LINE_S - EARLY_S:
            self._line_s = snapshot.time_s
            self._lines(vehicles)
        slow = snapshot.time_s - self._slow_s >= SLOW_S - EARLY_S
        if slow:
            self._slow_s = snapshot.time_s
            self._slow(snapshot)
        if all(known(*v.reported_m) for v in vehicles):  # colours go by place in the fleet
            self._places(vehicles, slow)

    def _focus(self, vehicles: Sequence[VehicleSnapshot]) -> scene.Point3:
        """What a close-up follows: whoever is or was the suspect, else the middle of the fleet."""
        self._suspect = next((v.sysid for v in vehicles if v.phase == "suspect"), self._suspect)
        shown = [v for v in vehicles if self._suspect in (None, v.sysid)]
        norths_m, easts_m = zip(*(v.reported_m for v in shown), strict=True)
        return scene.at(sum(norths_m) / len(shown), sum(easts_m) / len(shown), scene.CLOSE_M)

    def _lines(self, vehicles: Sequence[VehicleSnapshot]) -> None:
        self._series("speed", vehicles, lambda v: math.hypot(*v.velocity_mps))
        self._series("goal_distance", vehicles, self._goal_distance_m)
        for vehicle in vehicles:
            if vehicle.motor_outputs:
                outputs = [coarse(output) for output in vehicle.motor_outputs]
                self._batch.add(f"/motors/{vehicle.name}", col.SCALARS, outputs)
        if all(known(*v.reported_m) for v in vehicles):
            self._batch.add("/focus", col.CAMERAS, self._focus(vehicles))

    def _slow(self, snapshot: Snapshot) -> None:
        self._series("battery", snapshot.vehicles, lambda v: v.battery_percent)
        self._series("satellites", snapshot.vehicles, lambda v: v.gps_satellites)
        self._batch.add("/alarm/threshold", col.SCALARS, snapshot.threshold)
        self._batch.add("/goal_distance/radius", col.SCALARS, self._reached_m)

    def _places(self, vehicles: Sequence[VehicleSnapshot], slow: bool) -> None:
        bodies = [body(v.reported_m, v.yaw_rad, self._radii_m[v.sysid], 0.0) for v in vehicles]
        self._batch.add("/fleet", col.BODIES, bodies)
        steps = [
            self._trails.step(v.sysid, scene.at(*v.reported_m), vehicle_color(k))
            for k, v in enumerate(vehicles)
        ]
        if moved := [step for step in steps if step]:
            self._batch.add("/trail", col.SEGMENTS, moved)
        arrows = [
            (*scene.at(*v.reported_m, scene.ARROW_Z_M), *_ahead(*v.setpoint_mps))
            for v in vehicles
            if v.setpoint_mps and any(v.setpoint_mps) and known(*v.setpoint_mps)
        ]
        if arrows or self._driven:
            self._batch.add("/setpoint", col.ARROWS, arrows)
        self._driven = bool(arrows)
        if slow:
            places = [ned_to_wgs84(*v.reported_m, self._origin) for v in vehicles]
            self._batch.add("/map/fleet", col.GEO_POINTS, places)

    def _goal_distance_m(self, vehicle: VehicleSnapshot) -> float:
        goal = self._goals[vehicle.sysid]
        return math.dist((goal.north_m, goal.east_m), vehicle.reported_m)

    def _series(
        self,
        quantity: str,
        vehicles: Sequence[VehicleSnapshot],
        value: Callable[[VehicleSnapshot], float],
    ) -> None:
        """NaN leaves a gap in a vehicle's line."""
        self._batch.add(f"/{quantity}", col.SCALARS, [coarse(value(v)) for v in vehicles])


def body(
    place_m: tuple[float, float], yaw_rad: float, radius_m: float, z_m: float
) -> tuple[float, ...]:
    """A row of `BODIES`; a heading that is not known points north."""
    north, east = body_to_ned(scene.NOSE_AT * radius_m, 0.0, yaw_rad if known(yaw_rad) else 0.0)
    nose = scene.at(place_m[0] + north, place_m[1] + east, z_m + scene.DISC_M)
    return (*scene.at(*place_m, z_m), *nose)


def _ahead(north_mps: float, east_mps: float) -> scene.Point3:
    return scene.at(AHEAD_S * north_mps, AHEAD_S * east_mps)


def known(*values: float) -> bool:
    return all(map(math.isfinite, values))


def coarse(value: float) -> float:
    """To a 512th of its unit: noise does not compress, zeros do."""
    return round(value * 512.0) / 512.0 if known(value) else value
