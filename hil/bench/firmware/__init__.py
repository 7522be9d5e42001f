"""Autopilots that are not ours, started as simulators in our world; one file for each kind.

Nothing of theirs is in this project: an environment variable names the binary.
"""

from collections.abc import Callable
from pathlib import Path

from hil.bench.firmware import ardupilot
from hil.bench.processes import Command
from hil.scenario import Scenario, Vehicle

Start = Callable[[Scenario, Vehicle, Path], Command]

_STARTS: dict[str, Start] = {ardupilot.NAME: ardupilot.start}
OURS = "testbed"


def is_foreign(vehicle: Vehicle) -> bool:
    """Whether its autopilot is somebody else's firmware."""
    return vehicle.autopilot != OURS


def start_of(autopilot: str) -> Start | None:
    """How a foreign autopilot is started here; None for one that can't be."""
    return _STARTS.get(autopilot)
