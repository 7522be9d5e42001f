"""Scenario files: the YAML schema, loading with messages for people, and the station's view.

`Scenario` is all there is to know; `StationView` is the part a real ground station would have.
Units are in the field names; positions are local NED metres from `origin`.
"""

from hil.scenario.faults import FaultModel, Onset
from hil.scenario.fields import PORTS_PER_VEHICLE
from hil.scenario.fleetfile import FleetFile, FleetVehicle
from hil.scenario.loading import MAX_FILE_BYTES, load_scenario, load_station_view
from hil.scenario.mission import (
    MIN_PUSH_MARGIN,
    Diagnosis,
    Expectation,
    GoalOutcome,
    Limits,
    Links,
    Planning,
    Priors,
)
from hil.scenario.periods import Period, in_effect
from hil.scenario.places import (
    Arena,
    Clock,
    Geofence,
    Obstacle,
    OriginModel,
    Patch,
    Point,
    Rectangle,
    Slope,
    Terrain,
    Wind,
)
from hil.scenario.schema import Scenario
from hil.scenario.station import STATION_AIRFRAMES, FleetMember, Safety, StationView, station_view
from hil.scenario.vehicles import Plant, Radio, Sensors, Uncertainty, Vehicle

__all__ = [
    "MAX_FILE_BYTES",
    "MIN_PUSH_MARGIN",
    "PORTS_PER_VEHICLE",
    "STATION_AIRFRAMES",
    "Arena",
    "Clock",
    "Diagnosis",
    "Expectation",
    "FaultModel",
    "FleetFile",
    "FleetMember",
    "FleetVehicle",
    "Geofence",
    "GoalOutcome",
    "Limits",
    "Links",
    "Obstacle",
    "Onset",
    "OriginModel",
    "Patch",
    "Period",
    "Planning",
    "Plant",
    "Point",
    "Priors",
    "Radio",
    "Rectangle",
    "Safety",
    "Scenario",
    "Sensors",
    "Slope",
    "StationView",
    "Terrain",
    "Uncertainty",
    "Vehicle",
    "Wind",
    "in_effect",
    "load_scenario",
    "load_station_view",
    "station_view",
]
