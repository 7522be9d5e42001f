"""When faults strike, at a world time or on a condition on the truth, and when they end (pure)."""

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass

from hil.errors import InputError
from hil.scenario import FaultModel, Scenario
from hil.world.truth import TruthRecord

_CONDITION = re.compile(r"(\w+)\.(\w+) *([<>]) *(-?[0-9.]+)")
_COMPARE = {"<": operator.lt, ">": operator.gt}


@dataclass(frozen=True)
class Condition:
    """`quantity` of a vehicle compared with a limit (m or m/s)."""

    sysid: int
    quantity: str
    comparison: str
    limit: float

    def holds(self, scenario: Scenario, record: TruthRecord) -> bool:
        v = record.vehicles[self.sysid]
        goal = scenario.vehicle(self.sysid).goal
        value = {
            "goal_distance_m": math.dist((v.north_m, v.east_m), (goal.north_m, goal.east_m)),
            "north_m": v.north_m,
            "east_m": v.east_m,
            "speed_mps": math.hypot(v.north_mps, v.east_mps),
        }[self.quantity]
        return bool(_COMPARE[self.comparison](value, self.limit))


def parse_condition(scenario: Scenario, text: str) -> Condition:
    """As in `rover_2.goal_distance_m < 2`. Raises InputError."""
    match = _CONDITION.fullmatch(text)
    sysids = {v.name: v.sysid for v in scenario.fleet}
    try:
        name, quantity, comparison, limit = match.groups() if match else ("", "", "", "")
        return Condition(sysids[name], quantity, comparison, float(limit))
    except (KeyError, ValueError):
        raise InputError(
            f"faults.onset.when = {text!r}: must be like 'rover_2.goal_distance_m < 2', "
            f"with a vehicle of {sorted(sysids)}"
        ) from None


class Onsets:
    """The faults that have not struck yet, and those that have not ended.

    Raises InputError for a condition it can't read.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._pending: list[tuple[FaultModel, Condition | None]] = [
            (f, parse_condition(scenario, f.onset.when) if f.onset.when else None)
            for f in scenario.faults
        ]
        self._ending: list[FaultModel] = []

    def at_start(self) -> tuple[FaultModel, ...]:
        """The faults of onset zero: these are in effect before the world's first step."""
        return self._take(lambda fault, _: fault.onset.at_s == 0.0)

    def due(self, record: TruthRecord) -> tuple[FaultModel, ...]:
        """The faults that strike now; each is returned once."""

        def strikes(fault: FaultModel, condition: Condition | None) -> bool:
            if condition is not None:
                return condition.holds(self._scenario, record)
            return fault.onset.at_s is not None and record.time_s >= fault.onset.at_s - 1e-9

        self._pending = [(f, c) for f, c in self._pending if not _is_over(f, record.time_s)]
        return self._take(strikes)

    def over(self, record: TruthRecord) -> tuple[FaultModel, ...]:
        """The faults that end now; each is returned once."""
        over = tuple(f for f in self._ending if _is_over(f, record.time_s))
        self._ending = [f for f in self._ending if f not in over]
        return over

    def _take(
        self, strikes: Callable[[FaultModel, Condition | None], bool]
    ) -> tuple[FaultModel, ...]:
        struck = tuple(fault for fault, condition in self._pending if strikes(fault, condition))
        self._pending = [p for p in self._pending if not strikes(*p)]
        self._ending += [fault for fault in struck if fault.until_s is not None]
        return struck


def _is_over(fault: FaultModel, time_s: float) -> bool:
    return fault.until_s is not None and time_s >= fault.until_s - 1e-9
