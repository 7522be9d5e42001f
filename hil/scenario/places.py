"""Where things are, and what everybody there has to live with: clock, wind, slope."""

import itertools
import math
from typing import Annotated, Self

from pydantic import BeforeValidator, Field, model_validator

from hil.frames import Origin
from hil.scenario.fields import Finite, Metres, Model
from hil.scenario.periods import Period, listed


class OriginModel(Model):
    lat_deg: Annotated[float, Field(ge=-85, le=85)] = 47.397742
    lon_deg: Annotated[float, Field(ge=-180, le=180)] = 8.545594
    alt_m: Finite = 488.0

    def origin(self) -> Origin:
        return Origin(self.lat_deg, self.lon_deg, self.alt_m)


class Rectangle(Model):
    """A part of the plane, along north and east."""

    north_min_m: Metres
    north_max_m: Metres
    east_min_m: Metres
    east_max_m: Metres

    @model_validator(mode="after")
    def _has_an_inside(self) -> Self:
        if self.north_min_m >= self.north_max_m or self.east_min_m >= self.east_max_m:
            what = type(self).__name__.lower()
            raise ValueError(f"the {what} is empty: each *_min_m must be below its *_max_m")
        return self

    def contains(self, point: "Point", margin_m: float = 0.0) -> bool:
        return (
            self.north_min_m + margin_m <= point.north_m <= self.north_max_m - margin_m
            and self.east_min_m + margin_m <= point.east_m <= self.east_max_m - margin_m
        )


class Arena(Rectangle):
    """It has solid walls."""


class Geofence(Rectangle):
    """No plan leaves it, though no wall is there. It is not uploaded to the vehicles."""


class Point(Model):
    north_m: Metres
    east_m: Metres


class Obstacle(Model):
    """Something solid: a disc around `at`, or with `to` a wall between both, with round ends."""

    at: Point
    to: Point | None = None
    radius_m: Annotated[float, Field(gt=0.0, le=1000.0, allow_inf_nan=False)]

    @property
    def ends(self) -> tuple[Point, Point]:
        """Equal for a disc."""
        return self.at, self.to or self.at

    def distance_m(self, point: Point) -> float:
        """From its surface; negative inside."""
        a, b = self.ends
        north_m, east_m = b.north_m - a.north_m, b.east_m - a.east_m
        along = (point.north_m - a.north_m) * north_m + (point.east_m - a.east_m) * east_m
        square = north_m**2 + east_m**2
        share = max(0.0, min(1.0, along / square)) if square > 0.0 else 0.0
        nearest_m = (a.north_m + share * north_m, a.east_m + share * east_m)
        return math.dist(nearest_m, (point.north_m, point.east_m)) - self.radius_m


Obstacles = Annotated[tuple[Obstacle, ...], Field(max_length=100)]


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


class Wind(Period):
    """Where the air goes to, steadily."""

    north_mps: Annotated[float, Field(ge=-50, le=50)] = 0.0
    east_mps: Annotated[float, Field(ge=-50, le=50)] = 0.0


class Slope(Period):
    """Rise of the ground per metre to the north and to the east."""

    north: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0
    east: Annotated[float, Field(ge=-0.5, le=0.5)] = 0.0


class Patch(Rectangle, Period):
    """A rectangle where rolling resistance and grip are multiplied by `friction`."""

    friction: Annotated[float, Field(ge=0, le=20)]


Winds = Annotated[
    tuple[Wind, ...], BeforeValidator(listed, json_schema_input_type=Wind | tuple[Wind, ...])
]
Slopes = Annotated[
    tuple[Slope, ...], BeforeValidator(listed, json_schema_input_type=Slope | tuple[Slope, ...])
]


class Terrain(Model):
    """What the world does to everybody. Truth only.

    Of winds, slopes and patches that overlap, in time or in place, the first counts.
    """

    wind: Annotated[Winds, Field(max_length=100)] = ()
    slope: Annotated[Slopes, Field(max_length=100)] = ()
    patches: Annotated[tuple[Patch, ...], Field(max_length=100)] = ()
