"""Faults of a scenario, and when they strike."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil.faults import Fault, Type, Unit, refusal
from hil.scenario.fields import Model, NonNegative, Numbers, SysId

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
    """`size` is a number or a vector in the units of docs/faults.md; most types need one.

    `announced`: the vehicle notices, and its telemetry says so. `applied_by`: the vehicle itself,
    told over MAVLink, or the world, for firmware that can't.
    """

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
    announced: bool = False

    @model_validator(mode="after")
    def _can_be_injected(self) -> Self:
        why_not = refusal(self.fault())
        if why_not:
            raise ValueError(why_not)
        return self

    def fault(self) -> Fault:
        unit, kind = Unit[self.unit.upper()], Type(self.type)
        return Fault(unit, kind, self.instances, self.axes, self.size)
