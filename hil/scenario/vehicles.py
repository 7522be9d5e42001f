"""The vehicles of a fleet, their radios and sensors, and how far they are from the data sheet."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from hil import airframe as airframes
from hil.airframe import Airframe
from hil.scenario.fields import (
    AirframeName,
    AutopilotName,
    Finite,
    Model,
    NonNegative,
    Positive,
    Seconds,
    Share,
    Spread,
    SysId,
    VehicleName,
)
from hil.scenario.periods import Period, listed
from hil.scenario.places import Point


class Radio(Period):
    """What a MAVLink link does to datagrams, for a while or always. Truth only.

    A loss of 1 is a black-out. `jitter_s` adds up to so much to the delay and keeps the order;
    `reordering` and `duplication` are shares of datagrams that come, or come again, 0.2 s late;
    `corruption` is the share of those in which a byte is garbled. What holds when a datagram is
    sent, counts.
    """

    direction: Literal["both", "to_vehicle", "to_station"] = "both"
    loss: Annotated[float, Field(ge=0, le=1)] = 0.0
    delay_s: Seconds = 0.0
    jitter_s: Seconds = 0.0
    duplication: Share = 0.0
    reordering: Share = 0.0
    corruption: Annotated[float, Field(ge=0, le=1)] = 0.0


Radios = Annotated[
    tuple[Radio, ...], BeforeValidator(listed, json_schema_input_type=Radio | tuple[Radio, ...])
]


class Identified(Model):
    """What `hil identify` found of one body axis, as it writes it.

    `latency_s` is from a report to the effect of what answers it; `link_s` of that is the link's.
    """

    model: str
    time_constant_s: Positive
    speed_gain: Positive
    latency_s: NonNegative
    link_s: NonNegative = 0.0
    parameters: tuple[Finite, ...]
    residual_mps: NonNegative
    residual_m: NonNegative
    nominal_residual_m: NonNegative


class Vehicle(Model):
    name: VehicleName
    sysid: SysId
    airframe: AirframeName = "omni_plus"
    autopilot: AutopilotName = "testbed"
    physics: Literal["json", "hil"] = "json"  # hil: a board in HIL mode, started by hand
    start: Point
    start_yaw_deg: Finite = 0.0
    goal: Point
    radio: Annotated[Radios, Field(max_length=100)] | None = None  # None: the scenario's
    identified: dict[Literal["x", "y"], Identified] = Field(default={})  # the station's twin of it

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


class Uncertainty(Model):
    """How far the station takes vehicles to be from their data sheets: ranges of its twins' draws.

    Each sigma is of a factor around 1: stall force and free speed of every motor, mass (with
    inertia and side grip), rolling resistance (with scrub). Contact friction and latency are drawn
    evenly from 0 to their maximum.
    """

    motor_gain_sigma: Spread = 0.03
    free_speed_sigma: Spread = 0.0
    mass_sigma: Spread = 0.02
    rolling_sigma: Spread = 0.10
    friction_max: Annotated[float, Field(ge=0, le=1)] = 0.3
    latency_max_s: Annotated[float, Field(ge=0, le=0.1)] = 0.1  # not above a telemetry period


class Plant(Model):
    """How far the world may be from the data sheet: one draw per vehicle and seed. Truth only."""

    motor_gain_sigma: NonNegative = 0.03
    mass_sigma: NonNegative = 0.02
    rolling_sigma: NonNegative = 0.10
    contact_friction: NonNegative = 0.2
