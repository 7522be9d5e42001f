"""Autopilots that are not ours, started as simulators in our world; one file for each kind.

Nothing of theirs is in this project: an environment variable names the binary.
"""

from collections.abc import Callable
from pathlib import Path

from hil.bench.firmware import ardupilot
from hil.bench.processes import Command
from hil.faults import Fault, Injection, to_clearing, to_injection
from hil.scenario import FaultModel, Scenario, Vehicle

Start = Callable[[Scenario, Vehicle, Path], Command]
Parameters = Callable[[Fault, float], tuple[tuple[str, float], ...] | None]

_STARTS: dict[str, Start] = {ardupilot.NAME: ardupilot.start}
_BREAKS: dict[str, Parameters] = {ardupilot.NAME: ardupilot.broken}
_MENDS: dict[str, Parameters] = {ardupilot.NAME: ardupilot.mended}
OURS = "testbed"


def is_foreign(vehicle: Vehicle) -> bool:
    """Whether its autopilot is somebody else's firmware."""
    return vehicle.autopilot != OURS


def start_of(autopilot: str) -> Start | None:
    """How a foreign autopilot is started here; None for one that can't be."""
    return _STARTS.get(autopilot)


def can_break(scenario: Scenario, fault: FaultModel) -> bool:
    """Whether the vehicle's own firmware can make the fault happen to itself."""
    return not is_foreign(scenario.vehicle(fault.vehicle)) or bool(
        _parameters(_BREAKS, scenario, fault)
    )


def breaking(scenario: Scenario, fault: FaultModel) -> Injection:
    """What goes to the vehicle's injector port; a foreign firmware is broken by parameters."""
    if not is_foreign(scenario.vehicle(fault.vehicle)):
        return to_injection(fault.fault(), fault.announced)
    return Injection(_parameters(_BREAKS, scenario, fault), ())


def mending(scenario: Scenario, fault: FaultModel) -> Injection:
    """What ends the fault."""
    if not is_foreign(scenario.vehicle(fault.vehicle)):
        return to_clearing(fault.fault().unit, fault.instances)
    return Injection(_parameters(_MENDS, scenario, fault), ())


def _parameters(
    by: dict[str, Parameters], scenario: Scenario, fault: FaultModel
) -> tuple[tuple[str, float], ...]:
    """Empty where there is no way."""
    way = by.get(scenario.vehicle(fault.vehicle).autopilot)
    return (way(fault.fault(), scenario.origin.lat_deg) if way else None) or ()
