"""Types of the fields of a scenario, with their limits; the base of all its models."""

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from hil import airframe as airframes
from hil.connection import parse_connection

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
AutopilotName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]  # a known one: station


def _speakable(text: str) -> str:
    parse_connection(text)
    return text


ConnectionText = Annotated[str, AfterValidator(_speakable)]
VehicleName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$")]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Spread = Annotated[float, Field(ge=0, le=0.3)]  # sigma of a factor around 1
Seconds = Annotated[float, Field(ge=0, le=60)]


def _known_airframe(name: str) -> str:
    if name not in airframes.AIRFRAMES:
        raise ValueError(f"no such airframe; there are {', '.join(airframes.AIRFRAMES)}")
    return name


AirframeName = Annotated[
    str, AfterValidator(_known_airframe), Field(json_schema_extra={"enum": [*airframes.AIRFRAMES]})
]


def _listed(value: Any) -> Any:
    """A single number where a list of them is meant."""
    return (value,) if isinstance(value, int | float) else value


Numbers = Annotated[tuple[Finite, ...], BeforeValidator(_listed)]


class Model(BaseModel):
    """Unknown keys are refused; values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)
