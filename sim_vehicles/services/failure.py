"""Failure injection: MAV_CMD_INJECT_FAILURE and the SIM_ parameters that carry sizes.

This service is on the injector's port alone; on the station's port it does not exist. It is shut
until SYS_FAILURE_EN is 1. An ACK of ACCEPTED means that the fault is in effect from the next step
on; what can't be done is UNSUPPORTED, and what can't be done to this vehicle is DENIED.
"""

import math
from collections.abc import Mapping

from hil.airframe import Airframe
from hil.damage import Damage, inject
from hil.faults import ANNOUNCE, ENGINE_MUL, GATE, KINDS, FailureType, Unit, size_parameters
from hil.mavlink import Command, Message, ParamType, Result, Severity, StatusText
from sim_vehicles.announcing import announcements
from sim_vehicles.parameters import Parameter, Parameters
from sim_vehicles.services.commands import DENIED, UNSUPPORTED, Executor, Order, Outcome

_POSSIBLE = frozenset((unit, kind.failure_type) for (unit, _), kind in KINDS.items()) | {
    (unit, FailureType.OK) for unit in Unit
}


def injection_parameters() -> Parameters:
    """The gate, and the sizes of faults as they stand before any is injected."""
    gate = Parameter(GATE, 0, 0, 1, ParamType.INT8)
    sizes = (Parameter(s.parameter, s.default, s.low, s.high) for _, s in size_parameters())
    announce = Parameter(ANNOUNCE, 0, 0, 1, ParamType.INT8)
    return Parameters((gate, announce, *sizes))


class FailureService:
    """Holds the faults in effect."""

    def __init__(self, sizes: Parameters, airframe: Airframe) -> None:
        self.sizes, self._airframe = sizes, airframe
        self.active = self._known = Damage.none(airframe)

    def news(self) -> tuple[StatusText, ...]:
        """What the vehicle has noticed of its faults since the last call."""
        before, self._known = self._known, self.active
        return announcements(before, self.active) if before is not self.active else ()

    def executors(self) -> Mapping[int, Executor]:
        return {Command.INJECT_FAILURE: self._inject}

    def _inject(self, order: Order) -> Outcome:
        unit, kind, instances = order.integer(1), order.integer(2), _instances(order)
        if (unit, kind) not in _POSSIBLE or unit is None or kind is None:
            return UNSUPPORTED
        if not self.sizes[GATE]:
            return Outcome(Result.DENIED, (_text(f"{GATE} is 0"),))
        if instances is None or self._is_impossible(unit, kind):
            return DENIED
        damage: Damage | None = self.active
        sizes = {name: self.sizes[name] for name in self.sizes.names}
        for instance in instances:
            damage = damage and inject(damage, unit, kind, instance, sizes, order.now_s)
        if damage is None:
            return DENIED
        self.active = damage
        if kind == FailureType.OK:
            self._forget_sizes(unit)
        name = f"{Unit(unit).name} {FailureType(kind).name} {list(instances)}"
        return Outcome(Result.ACCEPTED, (_text(name),))

    def _is_impossible(self, unit: int, kind: int) -> bool:
        """A propeller that lifts can't be driven backwards: its controller has no reverse."""
        reverses = unit == Unit.MOTOR and kind == FailureType.WRONG and self.sizes[ENGINE_MUL] < 0
        return reverses and not all(m.reversible for m in self._airframe.motors)

    def _forget_sizes(self, unit: int) -> None:
        for owner, size in size_parameters():
            if owner == unit:
                self.sizes.set(size.parameter, size.default)


def _text(words: str) -> Message:
    return StatusText(Severity.NOTICE, f"Failure: {words}")


def _instances(order: Order) -> tuple[int, ...] | None:
    """Param 3 is an instance (0 all), or NaN: then param 4 is a bit mask of them."""
    if not math.isnan(order.params[2]):
        instance = order.integer(3)
        return None if instance is None else (instance,)
    mask = order.integer(4)
    if mask is None or mask <= 0:
        return None
    return tuple(i + 1 for i in range(mask.bit_length()) if mask >> i & 1)
