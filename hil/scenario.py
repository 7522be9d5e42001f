"""Scenario files: the YAML schema, loading with messages for people, and the station's view.

`Scenario` is all there is to know; `StationView` is the part a real ground station would have.
Units are in the field names; positions are local NED metres from `origin`.
"""

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import yaml
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from hil import airframe as airframes
from hil.airframe import Airframe
from hil.errors import InputError
from hil.faults import Fault, Type, Unit, refusal
from hil.frames import Origin

MAX_FILE_BYTES = 1_000_000
MAX_SHOWN = 80  # characters of a wrong value in a message
MIN_PUSH_MARGIN = 1.5
MAX_PORT = 65_000
PORTS_PER_VEHICLE = 10

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Probability = Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)]
SysId = Annotated[int, Field(ge=1, le=249)]
GroundSysId = Annotated[int, Field(ge=1, le=254)]
Port = Annotated[int, Field(ge=1024, le=MAX_PORT)]
Metres = Annotated[float, Field(ge=-100_000, le=100_000)]  # the earth is flat within these
Horizon = Annotated[float, Field(gt=0, le=600)]
Seed = Annotated[int, Field(ge=0, le=2**31 - 1)]
VehicleName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]

STATION_AIRFRAMES = ("omni_plus",)  # those that the station's twin can be


def _known_airframe(name: str) -> str:
    if name not in airframes.AIRFRAMES:
        raise ValueError(f"no such airframe; there are {', '.join(airframes.AIRFRAMES)}")
    return name


AirframeName = Annotated[
    str, AfterValidator(_known_airframe), Field(json_schema_extra={"enum": [*airframes.AIRFRAMES]})
]


def _twinned_airframe(name: str) -> str:
    if name not in STATION_AIRFRAMES:
        known = ", ".join(STATION_AIRFRAMES)
        raise ValueError(f"the base station has no twin of that; it knows {known}")
    return name


def _listed(value: Any) -> Any:
    """A single number where a list of them is meant."""
    return (value,) if isinstance(value, int | float) else value


Numbers = Annotated[tuple[Finite, ...], BeforeValidator(_listed)]


class Model(BaseModel):
    """Unknown keys are refused; values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class OriginModel(Model):
    lat_deg: Annotated[float, Field(ge=-85, le=85)] = 47.397742
    lon_deg: Annotated[float, Field(ge=-180, le=180)] = 8.545594
    alt_m: Finite = 488.0

    def origin(self) -> Origin:
        return Origin(self.lat_deg, self.lon_deg, self.alt_m)


class Arena(Model):
    """A rectangle with solid walls."""

    north_min_m: Metres
    north_max_m: Metres
    east_min_m: Metres
    east_max_m: Metres

    @model_validator(mode="after")
    def _has_an_inside(self) -> Self:
        if self.north_min_m >= self.north_max_m or self.east_min_m >= self.east_max_m:
            raise ValueError("the arena is empty: each *_min_m must be below its *_max_m")
        return self

    def contains(self, point: "Point", margin_m: float = 0.0) -> bool:
        return (
            self.north_min_m + margin_m <= point.north_m <= self.north_max_m - margin_m
            and self.east_min_m + margin_m <= point.east_m <= self.east_max_m - margin_m
        )


class Point(Model):
    north_m: Metres
    east_m: Metres


class Clock(Model):
    """Rates of the whole testbed (Hz); each slower one must divide the next faster one."""

    physics_hz: Annotated[int, Field(ge=50, le=1200)] = 200
    autopilot_hz: Annotated[int, Field(ge=10, le=400)] = 50
    telemetry_hz: Annotated[int, Field(ge=1, le=50)] = 10
    setpoint_hz: Annotated[int, Field(ge=1, le=50)] = 10
    control_hz: Annotated[int, Field(ge=1, le=10)] = 2

    @model_validator(mode="after")
    def _rates_divide(self) -> Self:
        chain = ("physics_hz", "autopilot_hz", "telemetry_hz", "control_hz")
        for fast, slow in itertools.pairwise(chain):
            if getattr(self, fast) % getattr(self, slow):
                raise ValueError(
                    f"{slow} = {getattr(self, slow)} must divide {fast} = {getattr(self, fast)}"
                )
        return self


Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0, le=60)]


class Radio(Model):
    """What a MAVLink link does to datagrams, in each direction. Truth only.

    `jitter_s` adds up to so much to the delay and keeps the order; `reordering` and `duplication`
    are shares of datagrams that come, or come again, 0.2 s late.
    """

    loss: Share = 0.0
    delay_s: Seconds = 0.0
    jitter_s: Seconds = 0.0
    duplication: Share = 0.0
    reordering: Share = 0.0


class Vehicle(Model):
    name: VehicleName
    sysid: SysId
    airframe: AirframeName = "omni_plus"
    start: Point
    start_yaw_deg: Finite = 0.0
    goal: Point
    radio: Radio | None = None  # None: the scenario's

    @property
    def frame(self) -> Airframe:
        return airframes.AIRFRAMES[self.airframe]


class Sensors(Model):
    """Declared noise, known to the station (data sheet): RTK-class GPS, MEMS gyro."""

    gps_hz: Annotated[int, Field(ge=1, le=50)] = 10
    gps_position_sigma_m: Positive = 0.02
    gps_wander_sigma_m: NonNegative = 0.01
    gps_wander_time_s: Positive = 20.0
    gps_velocity_sigma_mps: Positive = 0.05
    gyro_sigma_radps: Positive = 0.005
    compass_sigma_rad: Positive = 0.01
    accel_sigma_mps2: Positive = 0.05
    level_sigma_rad: Positive = 0.002


class Wind(Model):
    """Where the air goes to, steadily."""

    north_mps: Annotated[float, Field(ge=-50, le=50)] = 0.0
    east_mps: Annotated[float, Field(ge=-50, le=50)] = 0.0


class Slope(Model):
    """Rise of the ground per metre to the north and to the east."""

    north: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    east: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0


class Patch(Arena):
    """A rectangle where rolling resistance and grip are multiplied by `friction`."""

    friction: Annotated[float, Field(ge=0, le=20)]


class Terrain(Model):
    """What the world does to everybody. Truth only; where patches overlap, the first counts."""

    wind: Wind = Wind()
    slope: Slope = Slope()
    patches: Annotated[tuple[Patch, ...], Field(max_length=100)] = ()


class Plant(Model):
    """How far the world may be from the data sheet: one draw per vehicle and seed. Truth only."""

    motor_gain_sigma: NonNegative = 0.03
    mass_sigma: NonNegative = 0.02
    rolling_sigma: NonNegative = 0.10
    contact_friction: NonNegative = 0.2


_QUANTITIES = "goal_distance_m|north_m|east_m|speed_mps"
_CONDITION = rf"^[a-z][a-z0-9_]*\.({_QUANTITIES}) *[<>] *-?[0-9.]+$"


class Onset(Model):
    """When a fault strikes: at a world time, or when a condition on the truth first holds."""

    at_s: NonNegative | None = None
    when: Annotated[
        str | None,
        Field(pattern=_CONDITION),
    ] = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.at_s is None) == (self.when is None):
            raise ValueError("an onset has exactly one of at_s and when")
        return self


class FaultModel(Model):
    """`size` is a number or a vector in the units of docs/faults.md; most types need one."""

    vehicle: SysId
    unit: Literal["motor", "esc", "gps", "gyro", "accel"]
    type: Literal[
        "off", "locked", "partial", "reversed", "stuck", "intermittent", "repeat", "offset",
        "drift", "glitch", "noise", "delay", "bias", "wrong",
    ]  # fmt: skip
    instances: tuple[Annotated[int, Field(ge=1, le=16)], ...] = ()
    axes: tuple[Literal["north", "east", "down"], ...] = ()
    size: Numbers = ()
    onset: Onset = Onset(at_s=0.0)

    @model_validator(mode="after")
    def _can_be_injected(self) -> Self:
        why_not = refusal(self.fault())
        if why_not:
            raise ValueError(why_not)
        return self

    def fault(self) -> Fault:
        unit, kind = Unit[self.unit.upper()], Type(self.type)
        return Fault(unit, kind, self.instances, self.axes, self.size)


class Priors(Model):
    """Weight of each family of hypotheses before any evidence; normalised when used."""

    motor: Positive = 0.45
    gps: Positive = 0.45
    none: Positive = 0.05
    unknown: Positive = 0.05


class Diagnosis(Model):
    evidence: Literal["position"] = "position"
    decide_at: Annotated[float, Field(gt=0.5, lt=1)] = 0.99
    plan_error: Annotated[float, Field(gt=0, lt=0.5)] = 0.01
    false_alarms_per_hour: Positive = 0.1
    tries: Annotated[int, Field(ge=1, le=20)] = 3
    priors: Priors = Priors()


class Planning(Model):
    """`planner` finds the experiment; the mission is always learned."""

    planner: Literal["ppo", "cem", "shooting", "random", "gradient", "ram"] = "ppo"
    objective: Literal["paper_distance", "paper_printed", "information"] = "paper_distance"
    preset: Literal["tuned", "paper"] = "tuned"
    suspect: Literal["held", "commanded"] = "held"
    alpha_horizon_s: Horizon = 8.0
    beta_horizon_s: Horizon = 40.0
    restarts: Annotated[int, Field(ge=0, le=100)] = 20
    planning_sim_s: NonNegative = 2.0


class Limits(Model):
    """What the station allows itself."""

    speed_mps: Positive = 1.0
    probe_speed_mps: Positive = 0.5
    probe_pulse_s: Annotated[float, Field(gt=0, le=0.5)] = 0.5
    goal_radius_m: Positive = 0.2
    mission_timeout_s: Positive = 180.0


class Links(Model):
    """Ports; None lets `hil run` pick free ones. Vehicle i uses base + 10 i."""

    host: str = "127.0.0.1"
    mavlink_port_base: Port | None = None
    physics_port_base: Port | None = None
    injector_port_base: Port | None = None
    station_sysid: GroundSysId = 250
    injector_sysid: GroundSysId = 251


GoalOutcome = Literal["reached", "uncertain", "unreached"]


class Expectation(Model):
    """What must come out for exit code 0. `hypothesis` is a name as `base_station` writes it."""

    alarm: bool = True
    sysid: SysId | None = None
    hypothesis: str | None = None
    goals: dict[SysId, tuple[GoalOutcome, ...]] = {}


class FleetMember(Model):
    """What the station knows of a vehicle."""

    name: VehicleName
    sysid: SysId
    airframe: Annotated[str, AfterValidator(_twinned_airframe)]
    start_yaw_deg: Finite
    goal: Point
    mavlink_port: Port

    @property
    def frame(self) -> Airframe:
        return airframes.AIRFRAMES[self.airframe]


class StationView(Model):
    """All that the base station is told. No truth, no faults, no seed of the world, no name."""

    origin: OriginModel
    arena: Arena
    yaw: Literal["locked", "free"]
    clock: Clock
    fleet: Annotated[tuple[FleetMember, ...], Field(min_length=1, max_length=100)]
    sensors: Sensors
    diagnosis: Diagnosis
    planning: Planning
    limits: Limits
    host: str
    station_sysid: GroundSysId
    station_seed: Seed

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        sysids = [m.sysid for m in self.fleet]
        _unique("fleet.sysid", sysids)
        _unique("fleet.name", [m.name for m in self.fleet])
        _unique("fleet.mavlink_port", [m.mavlink_port for m in self.fleet])
        if self.station_sysid in sysids:
            raise ValueError(f"station_sysid = {self.station_sysid} is also a vehicle's")
        _keep_inside(self.arena, "goal", self.fleet)
        return self


class Scenario(Model):
    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,63}$")]
    description: str = ""
    seed: Seed = 0
    origin: OriginModel = OriginModel()
    arena: Arena
    yaw: Literal["locked", "free"] = "locked"
    clock: Clock = Clock()
    fleet: Annotated[tuple[Vehicle, ...], Field(min_length=1, max_length=100)]
    sensors: Sensors = Sensors()
    plant: Plant = Plant()
    terrain: Terrain = Terrain()
    radio: Radio = Radio()
    faults: tuple[FaultModel, ...] = ()
    diagnosis: Diagnosis = Diagnosis()
    planning: Planning = Planning()
    limits: Limits = Limits()
    links: Links = Links()
    expect: Expectation = Expectation()

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        sysids = [v.sysid for v in self.fleet]
        _unique("fleet.sysid", sysids)
        _unique("fleet.name", [v.name for v in self.fleet])
        for role in ("station_sysid", "injector_sysid"):
            if getattr(self.links, role) in sysids:
                raise ValueError(f"links.{role} = {getattr(self.links, role)} is also a vehicle's")
        if self.links.station_sysid == self.links.injector_sysid:
            raise ValueError("links.station_sysid and links.injector_sysid must differ")
        self._check_ports()
        _keep_inside(self.arena, "start", self.fleet)
        _keep_inside(self.arena, "goal", self.fleet)
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


def _unique(where: str, values: Sequence[object]) -> None:
    for value in values:
        if values.count(value) > 1:
            raise ValueError(f"{where} = {value!r} is used more than once; make each unique")


def _keep_inside(arena: Arena, field: str, fleet: Sequence[Vehicle | FleetMember]) -> None:
    for i, v in enumerate(fleet):
        if not arena.contains(getattr(v, field), v.frame.radius_m):
            raise ValueError(
                f"fleet.{i}.{field} of {v.name} is outside the arena less the vehicle's "
                f"radius of {v.frame.radius_m} m; move it inside"
            )


def _pairs(fleet: Sequence[Vehicle]) -> list[tuple[Vehicle, Vehicle]]:
    return [(a, b) for i, a in enumerate(fleet) for b in fleet[i + 1 :]]


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
            start_yaw_deg=v.start_yaw_deg,
            goal=v.goal,
            mavlink_port=mavlink_port_base + PORTS_PER_VEHICLE * i,
        )
        for i, v in enumerate(scenario.fleet)
    )
    return StationView(
        origin=scenario.origin,
        arena=scenario.arena,
        yaw=scenario.yaw,
        clock=scenario.clock,
        fleet=fleet,
        sensors=scenario.sensors,
        diagnosis=scenario.diagnosis,
        planning=scenario.planning,
        limits=scenario.limits,
        host=scenario.links.host,
        station_sysid=scenario.links.station_sysid,
        station_seed=station_seed,
    )


M = TypeVar("M", bound=Model)


def load_scenario(path: Path, overrides: Sequence[str] = ()) -> Scenario:
    """Read a scenario; `overrides` are `key.path=value` as given to `--set`. Raises InputError."""
    tree = _read_map(path)
    for override in overrides:
        _apply_override(tree, override)
    return _validated(Scenario, path, tree)


def load_station_view(path: Path) -> StationView:
    """Read a station view. Raises InputError."""
    return _validated(StationView, path, _read_map(path))


def _validated(model: type[M], path: Path, tree: dict[str, Any]) -> M:
    try:
        return model.model_validate(tree)
    except ValidationError as error:
        raise InputError(f"{path}: {_one_line(error)}") from None


def _one_line(error: ValidationError) -> str:
    first, *rest = error.errors()
    where = ".".join(str(part) for part in first["loc"]) or "scenario"
    message = first["msg"].removeprefix("Value error, ")
    value = first.get("input")
    shown = "" if isinstance(value, dict | list | tuple | Model) else f" = {_short(repr(value))}"
    remedy = {
        "extra_forbidden": "; remove it, or see `hil schema` for the keys there are",
        "missing": "; add it, see `hil schema`",
    }.get(first["type"], "")
    more = f" (and {len(rest)} more)" if rest else ""
    return f"{where}{shown}: {message[0].lower()}{message[1:]}{remedy}{more}"


def _short(text: str) -> str:
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


class _StrictLoader(yaml.SafeLoader):
    """Safe YAML that also refuses a key given twice, and aliases (they can grow without bound)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not allowed")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.YAMLError(
                    f"key {key!r} is given twice (line {node.start_mark.line + 1})"
                )
        return super().construct_mapping(node, deep)


def _read_map(path: Path) -> dict[str, Any]:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; check the path") from None
    if len(raw) > MAX_FILE_BYTES:
        raise InputError(f"{path}: {len(raw)} bytes; the limit is {MAX_FILE_BYTES}")
    try:
        tree = yaml.load(raw.decode("utf-8"), _StrictLoader)  # a SafeLoader
    except UnicodeDecodeError:
        raise InputError(f"{path}: not UTF-8 text; a scenario is a YAML file") from None
    except RecursionError:
        raise InputError(f"{path}: not valid YAML: nested too deeply") from None
    except (yaml.YAMLError, ValueError) as error:  # a date or number that cannot be is a ValueError
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(tree, dict):
        kind = {type(None): "empty", list: "a list"}.get(type(tree), "a single value")
        raise InputError(f"{path}: is {kind}; a map of keys is needed, see `hil schema`")
    return tree


def _apply_override(tree: dict[str, Any], override: str) -> None:
    key_path, equals, text = override.partition("=")
    if not equals or not key_path:
        raise InputError(f"--set {override}: must be key.path=value, as in --set seed=3")
    try:
        value = yaml.load(text, _StrictLoader)  # a SafeLoader
    except (yaml.YAMLError, ValueError, RecursionError):
        raise InputError(f"--set {_short(override)}: the value is not valid YAML") from None
    *parents, last = key_path.split(".")
    node: Any = tree
    for key in parents:
        node = _child(node, key, override)
    if isinstance(node, dict):
        node[last] = value
    else:
        _child(node, last, override)
        node[int(last)] = value


def _child(node: Any, key: str, override: str) -> Any:
    if isinstance(node, list):
        if key.isdecimal() and int(key) < len(node):
            return node[int(key)]
        raise InputError(f"--set {override}: {key} is not an index below {len(node)}")
    if isinstance(node, dict):
        return node.setdefault(key, {})
    raise InputError(f"--set {override}: {key} is inside a plain value")
