"""The command protocol: COMMAND_LONG and COMMAND_INT, each answered by exactly one COMMAND_ACK."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from hil.mavlink import CommandAck, CommandInt, CommandLong, Message, Result
from sim_vehicles.services.service import Handlers, Replies, Request


@dataclass(frozen=True, slots=True)
class Order:
    """A command with its 7 params; NaN where the sender gave none.

    `frame` is the MAV_FRAME of a COMMAND_INT, whose params 5 and 6 are integers; else None.
    """

    now_s: float
    params: tuple[float, ...]
    frame: int | None = None

    def integer(self, number: int) -> int | None:
        """Param `number` (from 1) if it is a whole number."""
        value = self.params[number - 1]
        return int(value) if math.isfinite(value) and value == int(value) else None


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the ACK shall say, and messages to send after it."""

    result: Result
    messages: tuple[Message, ...] = ()


DENIED = Outcome(Result.DENIED)
UNSUPPORTED = Outcome(Result.UNSUPPORTED)
Executor = Callable[[Order], Outcome]


class CommandService:
    """Looks commands up by number; an unknown one is UNSUPPORTED, never silence."""

    def __init__(self, executors: Mapping[int, Executor]) -> None:
        self._executors = dict(executors)

    def handlers(self) -> Handlers:
        return {CommandLong: self._long, CommandInt: self._int}

    def _long(self, request: Request) -> Replies:
        return self._execute(request, Order(request.now_s, request.value.params))

    def _int(self, request: Request) -> Replies:
        value: CommandInt = request.value
        params = (*value.params, float(value.x), float(value.y), value.z)
        return self._execute(request, Order(request.now_s, params, value.frame))

    def _execute(self, request: Request, order: Order) -> Replies:
        number = request.value.command
        executor = self._executors.get(number)
        outcome = executor(order) if executor else UNSUPPORTED
        ack = CommandAck(number, outcome.result, request.sysid, request.compid)
        return [ack, *outcome.messages]
