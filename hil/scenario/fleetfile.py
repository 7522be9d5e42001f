"""Fleet files: real vehicles, or simulators started by hand, for `base-station FLEET`."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from hil.scenario.fields import (
    AirframeName,
    AutopilotName,
    ConnectionText,
    GroundSysId,
    Model,
    Seed,
    SysId,
    VehicleName,
)
from hil.scenario.mission import Diagnosis, Limits, Planning
from hil.scenario.places import Arena, Clock, OriginModel, Point
from hil.scenario.station import FleetMember, Safety, StationView
from hil.scenario.vehicles import Identified, Sensors, Uncertainty


class FleetVehicle(Model):
    """A vehicle and how it is spoken to. Vehicles may share a connection: system ids differ."""

    name: VehicleName
    sysid: SysId
    connection: ConnectionText
    airframe: AirframeName
    autopilot: AutopilotName
    goal: Point


class FoundVehicle(Model):
    """What `hil identify` wrote of a vehicle."""

    sysid: SysId
    axes: dict[Literal["x", "y"], Identified]
    noise: dict[str, float] = Field(default={})


class Found(Model):
    """The file that `hil identify` writes beside a fleet file; by the vehicles' names."""

    identified: dict[VehicleName, FoundVehicle]


class FleetFile(Model):
    """All that a station needs to drive what is there. `arena` is the fence, from `origin`."""

    origin: OriginModel
    arena: Arena
    fleet: Annotated[tuple[FleetVehicle, ...], Field(min_length=1, max_length=100)]
    safety: Safety
    yaw: Literal["locked", "free"] = "free"
    clock: Clock = Clock(telemetry_hz=10)
    sensors: Sensors = Sensors()
    uncertainty: Uncertainty = Uncertainty()
    diagnosis: Diagnosis = Diagnosis()
    planning: Planning = Planning()
    limits: Limits = Limits()
    station_sysid: GroundSysId = 250
    station_seed: Seed = 0

    @model_validator(mode="after")
    def _is_a_view(self) -> Self:
        self.view()
        return self

    def view(self, found: Mapping[str, FoundVehicle] = MappingProxyType({})) -> StationView:
        """The same, as the station knows it, with what was found of the vehicles, by name."""
        tree: dict[str, Any] = self.model_dump(exclude={"fleet"})
        members = tuple(
            FleetMember(
                **v.model_dump(),
                start_yaw_deg=0.0,
                identified=found[v.name].axes if v.name in found else {},
            )
            for v in self.fleet
        )
        return StationView(**tree, fleet=members, host="127.0.0.1")


def is_fleet_file(tree: dict[str, Any]) -> bool:
    """Whether a map is meant as a fleet file; a station view carries ports and a host."""
    return "host" not in tree and "name" not in tree
