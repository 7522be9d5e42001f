"""Faults of a scenario, and when they strike."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from hil.faults import WORLD_KINDS, Fault, Type, Unit, refusal
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
    told over MAVLink, or the world, for firmware that can't. At `until_s` it is cleared, with all
    other faults of the same unit and instances.
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
    until_s: NonNegative | None = None
    announced: bool = False
    applied_by: Literal["vehicle", "world"] = "vehicle"

    @model_validator(mode="after")
    def _can_be_injected(self) -> Self:
        why_not = refusal(self.fault()) or (self._not_by_the_world() if self.by_world else None)
        if why_not:
            raise ValueError(why_not)
        if self.until_s is not None and self.until_s <= (self.onset.at_s or 0.0):
            raise ValueError(f"until_s = {self.until_s:g} must be later than the onset")
        return self

    @property
    def by_world(self) -> bool:
        return self.applied_by == "world"

    def _not_by_the_world(self) -> str | None:
        fault = self.fault()
        if (fault.unit, fault.type) not in WORLD_KINDS:
            known = ", ".join(f"{u.name.lower()} {t}" for u, t in WORLD_KINDS)
            return f"the world can't apply {self.unit} {self.type}; it can {known}"
        if self.announced:
            return "a fault that the world applies can't be announced: the vehicle knows nothing"
        return None

    def fault(self) -> Fault:
        unit, kind = Unit[self.unit.upper()], Type(self.type)
        return Fault(unit, kind, self.instances, self.axes, self.size)
