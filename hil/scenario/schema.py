"""The scenario: all there is to know. Its parts must fit together."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil.scenario.checks import check_fence, keep_clear, keep_inside, unique
from hil.scenario.faults import FaultModel
from hil.scenario.fields import MAX_PORT, PORTS_PER_VEHICLE, Model, Seed
from hil.scenario.mission import Diagnosis, Expectation, Limits, Links, Planning
from hil.scenario.places import Arena, Clock, Geofence, Obstacles, OriginModel, Terrain
from hil.scenario.vehicles import Plant, Radios, Sensors, Uncertainty, Vehicle


class Scenario(Model):
    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")]
    description: str = ""
    seed: Seed = 0
    origin: OriginModel = OriginModel()
    arena: Arena
    geofence: Geofence | None = None
    obstacles: Obstacles = ()
    yaw: Literal["locked", "free"] = "locked"
    clock: Clock = Clock()
    fleet: Annotated[tuple[Vehicle, ...], Field(min_length=1, max_length=100)]
    sensors: Sensors = Sensors()
    uncertainty: Uncertainty = Uncertainty()
    plant: Plant = Plant()
    terrain: Terrain = Terrain()
    radio: Annotated[Radios, Field(max_length=100)] = ()
    faults: tuple[FaultModel, ...] = ()
    diagnosis: Diagnosis = Diagnosis()
    planning: Planning = Planning()
    limits: Limits = Limits()
    links: Links = Links()
    expect: Expectation = Expectation()

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        sysids = [v.sysid for v in self.fleet]
        unique("fleet.sysid", sysids)
        unique("fleet.name", [v.name for v in self.fleet])
        for role in ("station_sysid", "injector_sysid"):
            if getattr(self.links, role) in sysids:
                raise ValueError(f"links.{role} = {getattr(self.links, role)} is also a vehicle's")
        if self.links.station_sysid == self.links.injector_sysid:
            raise ValueError("links.station_sysid and links.injector_sysid must differ")
        self._check_ports()
        keep_inside(self.arena, "start", self.fleet)
        keep_inside(self.arena, "goal", self.fleet)
        check_fence(self.geofence, self.arena, ("start", "goal"), self.fleet)
        keep_clear(self.obstacles, "start", self.fleet)
        keep_clear(self.obstacles, "goal", self.fleet)
        for v in self.fleet:
            if self.yaw == "locked" and not v.frame.axis_motors("y") and not v.frame.flight:
                raise ValueError(
                    f"{v.name} is a {v.airframe}, which must turn to go sideways; yaw: free lets it"
                )
        for a, b in _pairs(self.fleet):
            gap = math.dist((a.start.north_m, a.start.east_m), (b.start.north_m, b.start.east_m))
            if gap < a.frame.radius_m + b.frame.radius_m:
                raise ValueError(
                    f"{a.name} and {b.name} start {gap:.2f} m apart, inside each other; "
                    f"at least {a.frame.radius_m + b.frame.radius_m:.2f} m are needed"
                )
        for i, f in enumerate(self.faults):
            self._check_fault(f"faults.{i}", f)
        for sysid in (*self.expect.goals, *([self.expect.sysid] if self.expect.sysid else [])):
            if sysid not in sysids:
                raise ValueError(f"expect names vehicle {sysid}; the fleet has {sysids}")
        return self

    def _check_ports(self) -> None:
        count = len(self.fleet)
        for role in ("mavlink_port_base", "physics_port_base", "injector_port_base"):
            base = getattr(self.links, role)
            if base is not None and (last := base + PORTS_PER_VEHICLE * (count - 1)) > MAX_PORT:
                raise ValueError(
                    f"links.{role} = {base}: {count} vehicles need ports up to {last}; the limit "
                    f"is {MAX_PORT}; choose a lower base"
                )

    def _check_fault(self, where: str, fault: FaultModel) -> None:
        sysids = [v.sysid for v in self.fleet]
        if fault.vehicle not in sysids:
            raise ValueError(f"{where}.vehicle = {fault.vehicle} is not in the fleet {sysids}")
        frame = self.vehicle(fault.vehicle).frame
        if fault.type == "reversed" and not all(m.reversible for m in frame.motors):
            raise ValueError(f"{where}: the motors of {frame.name} can't be reversed")
        for instance in fault.instances:
            limit = len(frame.motors) if fault.unit in ("motor", "esc") else 1
            if instance > limit:
                raise ValueError(f"{where}.instances has {instance}; the highest is {limit}")
        if fault.onset.when and fault.onset.when.split(".")[0] not in [v.name for v in self.fleet]:
            raise ValueError(f"{where}.onset.when names a vehicle that is not in the fleet")

    def vehicle(self, sysid: int) -> Vehicle:
        return next(v for v in self.fleet if v.sysid == sysid)


def _pairs(fleet: Sequence[Vehicle]) -> list[tuple[Vehicle, Vehicle]]:
    return [(a, b) for i, a in enumerate(fleet) for b in fleet[i + 1 :]]
