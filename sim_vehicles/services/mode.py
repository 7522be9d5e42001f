"""Modes and arming: MAV_CMD_DO_SET_MODE, SET_MODE, MAV_CMD_COMPONENT_ARM_DISARM."""

from collections.abc import Callable, Mapping

from hil.mavlink import MODE_FLAG_CUSTOM, Command, Result, SetMode
from sim_vehicles.autopilot import Autopilot, Readiness, Transition, arm, disarm, set_mode
from sim_vehicles.services.commands import DENIED, Executor, Order, Outcome
from sim_vehicles.services.service import Handlers, Replies, Request

Change = Callable[[Autopilot, Readiness], Transition]


class ModeService:
    """Asks for transitions. `apply` puts one into effect, given what the vehicle is ready for.

    `change_mode` takes custom mode numbers; without it they are a rover's.
    """

    def __init__(
        self,
        apply: Callable[[Change], Result],
        change_mode: Callable[[int], Result] | None = None,
    ) -> None:
        self._apply = apply
        self._change_mode = change_mode or self._rover_mode

    def handlers(self) -> Handlers:
        return {SetMode: self._set_mode_message}

    def executors(self) -> Mapping[int, Executor]:
        return {
            Command.DO_SET_MODE: self._do_set_mode,
            Command.COMPONENT_ARM_DISARM: self._arm_disarm,
        }

    def _set_mode_message(self, request: Request) -> Replies:
        value: SetMode = request.value
        if value.target_sysid != 0 and value.base_mode & MODE_FLAG_CUSTOM:
            self._change_mode(value.custom_mode)
        return []

    def _do_set_mode(self, order: Order) -> Outcome:
        base_mode, custom_mode = order.integer(1), order.integer(2)
        if base_mode is None or custom_mode is None or not base_mode & MODE_FLAG_CUSTOM:
            return DENIED
        return Outcome(self._change_mode(custom_mode))

    def _rover_mode(self, number: int) -> Result:
        return self._apply(lambda state, ready: set_mode(state, number, ready))

    def _arm_disarm(self, order: Order) -> Outcome:
        """Disarming always works, so the emergency stop (param2 21196) needs no other way."""
        wanted = order.integer(1)
        if wanted == 1:
            return Outcome(self._apply(arm))
        if wanted == 0:
            return Outcome(self._apply(lambda state, _ready: disarm(state)))
        return DENIED
