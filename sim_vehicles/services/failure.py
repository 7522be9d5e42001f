"""Failure injection: MAV_CMD_INJECT_FAILURE and the SIM_ parameters that carry sizes.

This service is on the injector's port alone; on the station's port it does not exist. An ACK of
ACCEPTED means that the fault is in effect from the next step on.
"""

import math
from collections.abc import Mapping

from hil.faults import SUPPORTED, ActiveFaults, Type, Unit
from hil.mavlink import Command, ParamType, Result, Severity, StatusText
from sim_vehicles.parameters import Parameter, Parameters
from sim_vehicles.services.commands import DENIED, UNSUPPORTED, Executor, Order, Outcome

STUCK_AXES = "SIM_GPS1_STUCK"  # bits north, east, down; 0 means all of them
_POSSIBLE = SUPPORTED | {(unit, Type.OK) for unit, _ in SUPPORTED}


def injection_parameters() -> Parameters:
    """The sizes of faults, as they stand before any is injected."""
    return Parameters((Parameter(STUCK_AXES, 0, 0, 7, ParamType.INT8),))


class FailureService:
    """Holds the faults in effect."""

    def __init__(self, sizes: Parameters, motor_count: int) -> None:
        self._sizes, self._motor_count = sizes, motor_count
        self.active = ActiveFaults()

    def executors(self) -> Mapping[int, Executor]:
        return {Command.INJECT_FAILURE: self._inject}

    def _inject(self, order: Order) -> Outcome:
        unit, kind, instances = order.integer(1), order.integer(2), _instances(order)
        if (unit, kind) not in _POSSIBLE or unit is None or kind is None:
            return UNSUPPORTED
        if instances is None:
            return DENIED
        stuck_mask = int(self._sizes[STUCK_AXES])
        faults: ActiveFaults | None = self.active
        for instance in instances:
            faults = faults and faults.apply(unit, kind, instance, self._motor_count, stuck_mask)
        if faults is None:
            return DENIED
        self.active = faults
        text = f"{Unit(unit).name} {Type(kind).name} {list(instances)}"
        return Outcome(Result.ACCEPTED, (StatusText(Severity.NOTICE, f"Failure: {text}"),))


def _instances(order: Order) -> tuple[int, ...] | None:
    """Param 3 is an instance (0 all), or NaN: then param 4 is a bit mask of them."""
    if not math.isnan(order.params[2]):
        instance = order.integer(3)
        return None if instance is None else (instance,)
    mask = order.integer(4)
    if mask is None or mask <= 0:
        return None
    return tuple(i + 1 for i in range(mask.bit_length()) if mask >> i & 1)
