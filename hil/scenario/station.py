"""The station's view: the part of a scenario that a real ground station would have."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from hil import airframe as airframes
from hil.airframe import Airframe
from hil.connection import Connection, parse_connection
from hil.errors import InputError
from hil.scenario.checks import check_fence, keep_clear, keep_inside, unique
from hil.scenario.fields import (
    PORTS_PER_VEHICLE,
    AutopilotName,
    ConnectionText,
    Finite,
    GroundSysId,
    Model,
    NonNegative,
    Port,
    Positive,
    Seed,
    SysId,
    VehicleName,
)
from hil.scenario.mission import Diagnosis, Limits, Planning
from hil.scenario.places import Arena, Clock, Geofence, Obstacles, OriginModel, Point
from hil.scenario.schema import Scenario
from hil.scenario.vehicles import Identified, Sensors, Uncertainty

STATION_AIRFRAMES = ("omni_plus", "skid_steer")  # those that the station's twin can be


def _twinned_airframe(name: str) -> str:
    if name not in STATION_AIRFRAMES:
        known = ", ".join(STATION_AIRFRAMES)
        raise ValueError(f"the base station has no twin of that; it knows {known}")
    return name


class FleetMember(Model):
    """What the station knows of a vehicle."""

    name: VehicleName
    sysid: SysId
    airframe: Annotated[str, AfterValidator(_twinned_airframe)]
    autopilot: AutopilotName = "testbed"
    start_yaw_deg: Finite
    goal: Point
    mavlink_port: Port | None = None  # udpin on the view's host
    connection: ConnectionText | None = None
    identified: dict[Literal["x", "y"], Identified] = Field(default={})

    @model_validator(mode="after")
    def _can_be_spoken_to(self) -> Self:
        if (self.mavlink_port is None) == (self.connection is None):
            raise ValueError(f"{self.name} needs exactly one of connection and mavlink_port")
        return self

    @property
    def frame(self) -> Airframe:
        return airframes.AIRFRAMES[self.airframe]


class Safety(Model):
    """What keeps people and machines whole, where vehicles are real."""

    allow_contact: bool
    contact_speed_mps: Positive = 0.3  # approaching another vehicle, where contact is allowed
    contact_impulse_ns: Positive = 10.0  # mass times speed at a contact
    fence_margin_m: NonNegative = 0.5  # inside the arena, where a vehicle is stopped


class StationView(Model):
    """All that the base station is told. No truth, no faults, no seed of the world, no name."""

    origin: OriginModel
    arena: Arena
    geofence: Geofence | None = None
    obstacles: Obstacles = ()
    yaw: Literal["locked", "free"]
    clock: Clock
    fleet: Annotated[tuple[FleetMember, ...], Field(min_length=1, max_length=100)]
    sensors: Sensors
    uncertainty: Uncertainty = Uncertainty()
    diagnosis: Diagnosis
    planning: Planning
    limits: Limits
    safety: Safety | None = None  # None: a simulation, where nothing can be hurt
    host: str
    station_sysid: GroundSysId
    station_seed: Seed

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        sysids = [m.sysid for m in self.fleet]
        unique("fleet.sysid", sysids)
        unique("fleet.name", [m.name for m in self.fleet])
        ports = [m.mavlink_port for m in self.fleet if m.mavlink_port is not None]
        unique("fleet.mavlink_port", ports)
        if self.station_sysid in sysids:
            raise ValueError(f"station_sysid = {self.station_sysid} is also a vehicle's")
        keep_inside(self.arena, "goal", self.fleet)
        check_fence(self.geofence, self.arena, ("goal",), self.fleet)
        keep_clear(self.obstacles, "goal", self.fleet)
        return self

    def connection_of(self, member: FleetMember) -> Connection:
        """Where a member is spoken to."""
        if member.connection is not None:
            return parse_connection(member.connection)
        assert member.mavlink_port is not None
        return Connection("udpin", self.host, member.mavlink_port)

    @property
    def first_on_each_link(self) -> tuple[FleetMember, ...]:
        """One member for each connection: the others there hear what is for all."""
        firsts: dict[Connection, FleetMember] = {}
        for member in self.fleet:
            firsts.setdefault(self.connection_of(member), member)
        return tuple(firsts.values())


def station_view(scenario: Scenario, mavlink_port_base: int, station_seed: int) -> StationView:
    """The part of a scenario that a ground station would have been told.

    Raises InputError for an airframe that the station has no twin of.
    """
    for v in scenario.fleet:
        if v.airframe not in STATION_AIRFRAMES:
            raise InputError(
                f"{scenario.name}: {v.name} is a {v.airframe}, and the base station has no twin of "
                f"that yet; it knows {', '.join(STATION_AIRFRAMES)}"
            )
    fleet = tuple(
        FleetMember(
            name=v.name,
            sysid=v.sysid,
            airframe=v.airframe,
            autopilot=v.autopilot,
            start_yaw_deg=v.start_yaw_deg,
            goal=v.goal,
            identified=v.identified,
            mavlink_port=mavlink_port_base + PORTS_PER_VEHICLE * i,
        )
        for i, v in enumerate(scenario.fleet)
    )
    return StationView(
        origin=scenario.origin,
        arena=scenario.arena,
        geofence=scenario.geofence,
        obstacles=scenario.obstacles,
        yaw=scenario.yaw,
        clock=scenario.clock,
        fleet=fleet,
        sensors=scenario.sensors,
        uncertainty=scenario.uncertainty,
        diagnosis=scenario.diagnosis,
        planning=scenario.planning,
        limits=scenario.limits,
        host=scenario.links.host,
        station_sysid=scenario.links.station_sysid,
        station_seed=station_seed,
    )
