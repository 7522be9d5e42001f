"""What the base station says on its stdout, one JSON object a line, as typed values (pure).

`time_s` is fleet time. Keys this bench does not know are ignored, so that a station may say more.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from hil.errors import ProcessDiedError
from hil.scenario import GoalOutcome

STATION = "base-station"


class Line(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class Ready(Line):
    type: Literal["ready"]


class Tick(Line):
    """About every 0.1 s of fleet time; the world may run 0.5 s ahead of it."""

    type: Literal["tick"]
    time_s: float
    phase: str


class StationEvent(Line):
    """As `base_station.records.Event`."""

    type: Literal["event"]
    time_s: float
    kind: str
    text: str
    data: dict[str, Any] = {}


class Progress(Line):
    """How a training is getting on."""

    type: Literal["progress"]
    kind: Literal["alpha", "beta"]
    attempt: int
    timesteps: int
    total_timesteps: int
    mean_reward: float


class Verdict(Line):
    """Who is broken and how; `posterior` is by hypothesis."""

    sysid: int
    hypothesis: str
    posterior: dict[str, float]
    decided: bool


class DeclaredGoal(Line):
    """What the station says of a vehicle's goal, and when it said so."""

    declared: GoalOutcome
    time_s: float | None = None


class PhaseTime(Line):
    phase: str
    wall_s: float
    sim_s: float


class TrainingSummary(Line):
    kind: Literal["alpha", "beta"]
    planner: str
    preset: str
    timesteps: int
    restarts: int
    wall_s: float


class Outcome(Line):
    """All that the station concludes, from its own belief."""

    verdict: Verdict | None
    alarm: bool
    goals: dict[int, DeclaredGoal]
    phases: tuple[PhaseTime, ...] = ()
    trainings: tuple[TrainingSummary, ...] = ()


class ResultLine(Line):
    """The last line."""

    type: Literal["result"]
    outcome: Outcome


StationLine = Ready | Tick | StationEvent | Progress | ResultLine
_ADAPTER: TypeAdapter[StationLine] = TypeAdapter(
    Annotated[StationLine, Field(discriminator="type")]
)


def parse_station_line(line: str) -> StationLine | None:
    """None for a line that is no JSON object. Raises ProcessDiedError on a broken one."""
    if not line.startswith("{"):
        return None
    try:
        return _ADAPTER.validate_json(line)
    except ValidationError as error:
        raise _broken(error) from None


def as_station_line(tree: dict[str, Any]) -> StationLine:
    """The same from an object, as it comes in memory. Raises ProcessDiedError."""
    try:
        return _ADAPTER.validate_python(tree)
    except ValidationError as error:
        raise _broken(error) from None


def _broken(error: ValidationError) -> ProcessDiedError:
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    return ProcessDiedError(
        f"{STATION} said a line that breaks its contract: {where}: {first['msg']}"
    )
