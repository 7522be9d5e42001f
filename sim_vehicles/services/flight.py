"""MAV_CMD_NAV_TAKEOFF and MAV_CMD_NAV_LAND, for what flies."""

import math
from collections.abc import Callable, Mapping

from hil.mavlink import Command, Result
from sim_vehicles.services.commands import DENIED, Executor, Order, Outcome

HIGHEST_M = 1_000.0


class FlightService:
    """`take_off` gets a height above home (m); both say whether it is done."""

    def __init__(self, take_off: Callable[[float], Result], land: Callable[[], Result]) -> None:
        self._take_off, self._land = take_off, land

    def executors(self) -> Mapping[int, Executor]:
        return {Command.NAV_TAKEOFF: self._rise, Command.NAV_LAND: self._come_down}

    def _rise(self, order: Order) -> Outcome:
        """Param 7 is the height above home."""
        height_m = order.params[6]
        if not math.isfinite(height_m) or not 0.0 < height_m <= HIGHEST_M:
            return DENIED
        return Outcome(self._take_off(height_m))

    def _come_down(self, _order: Order) -> Outcome:
        """Where it is."""
        return Outcome(self._land())
