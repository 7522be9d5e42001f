"""What begins and ends at a world time: a stretch of bad radio, wind, slope or ground."""

from collections.abc import Iterable
from typing import Any, Self, TypeVar

from pydantic import model_validator

from hil.scenario.fields import Model, NonNegative

_SLACK_S = 1e-9  # times are sums of steps


class Period(Model):
    """From `from_s` (world time) until just before `until_s`; None is for ever."""

    from_s: NonNegative = 0.0
    until_s: NonNegative | None = None

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError(
                f"until_s = {self.until_s:g} must be later than from_s = {self.from_s:g}"
            )
        return self

    def holds(self, time_s: float) -> bool:
        begun = time_s >= self.from_s - _SLACK_S
        return begun and (self.until_s is None or time_s < self.until_s - _SLACK_S)


P = TypeVar("P", bound=Period)


def in_effect(periods: Iterable[P], time_s: float) -> P | None:
    """The first that holds, of those that overlap."""
    return next((p for p in periods if p.holds(time_s)), None)


def listed(value: Any) -> Any:
    """A single one where a list of them is meant."""
    return (value,) if isinstance(value, dict | Period) else value
