"""MAV_CMD_DO_FENCE_ENABLE; the zones themselves travel by the mission protocol."""

from collections.abc import Mapping

from hil.mavlink import Command, Result
from sim_vehicles.navigator import CIRCLE_BIT, Navigator
from sim_vehicles.parameters import Parameters
from sim_vehicles.services.commands import DENIED, Executor, Order, Outcome


class FenceService:
    """Switches FENCE_ENABLE."""

    def __init__(self, parameters: Parameters, navigator: Navigator) -> None:
        self._parameters, self._navigator = parameters, navigator

    def executors(self) -> Mapping[int, Executor]:
        return {Command.DO_FENCE_ENABLE: self._enable}

    def _enable(self, order: Order) -> Outcome:
        """Param 1: 0 off, 1 on. There must be something to keep to."""
        wanted = order.integer(1)
        if wanted not in (0, 1):
            return DENIED
        has_circle = int(self._parameters["FENCE_TYPE"]) & CIRCLE_BIT
        if wanted and not has_circle and not self._navigator.has_zones:
            return Outcome(Result.FAILED)
        self._parameters.set("FENCE_ENABLE", float(wanted or 0))
        return Outcome(Result.ACCEPTED)
