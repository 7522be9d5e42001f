"""The injector: breaks a vehicle over MAVLink, from its own system id, on its own link (pure).

`step(now, received)` returns what to send; the same code runs over UDP and in memory. Parameters
go first, then commands, one at a time, each sent again until it is echoed or acknowledged. Faults
that the world applies go to the world instead, and never near a vehicle.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from hil.bench.firmware import breaking, mending
from hil.errors import InputError, ProcessDiedError
from hil.faults import Injection
from hil.mavlink import (
    COMPONENT_GCS,
    Command,
    CommandAck,
    Decoder,
    Encoder,
    ParamFailed,
    ParamValue,
    Received,
    Result,
    Signing,
)
from hil.scenario import FaultModel, Scenario
from hil.world.orders import Break, Mend

RESEND_S = 0.5
ANSWER_WITHIN_S = 10.0


@dataclass(frozen=True)
class SetParameter:
    name: str
    value: float

    def datagram(self, encoder: Encoder, target: int) -> bytes:
        return encoder.param_set(target, self.name, self.value)

    def answered_by(self, value: object) -> bool:
        return isinstance(value, ParamValue) and value.name == self.name

    def refusal(self, value: object) -> str | None:
        """Why `value` says no, if it does."""
        if isinstance(value, ParamFailed) and value.name == self.name:
            return f"parameter {self.name}: error {value.error}"
        if isinstance(value, ParamValue) and value.name == self.name:
            if math.isclose(value.value, self.value, rel_tol=1e-6):
                return None
            return f"parameter {self.name}: stays {value.value:g} instead of {self.value:g}"
        return None


@dataclass(frozen=True)
class InjectFailure:
    unit: int
    type: int
    instance: int

    def datagram(self, encoder: Encoder, target: int) -> bytes:
        return encoder.inject_failure(target, self.unit, self.type, self.instance)

    def answered_by(self, value: object) -> bool:
        return (
            isinstance(value, CommandAck)
            and value.command == Command.INJECT_FAILURE
            and value.result != Result.IN_PROGRESS
        )

    def refusal(self, value: object) -> str | None:
        """Why `value` says no, if it does."""
        if not isinstance(value, CommandAck) or not self.answered_by(value):
            return None
        if value.result == Result.ACCEPTED:
            return None
        numbers = f"unit {self.unit}, type {self.type}, instance {self.instance}"
        return f"MAV_CMD_INJECT_FAILURE ({numbers}): result {value.result}"


Order = SetParameter | InjectFailure
Report = Callable[[FaultModel], None]


class Injector:
    """Injects faults into one vehicle, in the order they are added."""

    def __init__(self, name: str, target: int, sysid: int, signing: Signing | None = None) -> None:
        self.name, self.target = name, target
        self._encoder = Encoder(sysid, COMPONENT_GCS, signing)
        self._decoder = Decoder(signing)
        self._orders: deque[Order] = deque()
        self._asked_s: float | None = None  # when the first order was first sent
        self._sent_s = -math.inf

    @property
    def done(self) -> bool:
        """Everything that was added is in effect."""
        return not self._orders

    def add(self, injection: Injection) -> None:
        self._orders += [SetParameter(name, value) for name, value in injection.parameters]
        self._orders += [InjectFailure(*numbers) for numbers in injection.commands]

    def step(self, now_s: float, datagrams: Iterable[bytes]) -> list[bytes]:
        """Datagrams to send. Raises as `Breaker.step`."""
        for datagram in datagrams:
            for received in self._decoder.decode(datagram):
                self._take(received)
        if not self._orders or now_s - self._sent_s < RESEND_S:
            return []
        self._sent_s = now_s
        self._asked_s = now_s if self._asked_s is None else self._asked_s
        if now_s - self._asked_s > ANSWER_WITHIN_S:
            raise ProcessDiedError(
                f"{self.name} does not answer on its injector port for {ANSWER_WITHIN_S:.0f} s"
            )
        return [self._orders[0].datagram(self._encoder, self.target)]

    def _take(self, received: Received) -> None:
        if received.sysid != self.target or not self._orders:
            return
        order, value = self._orders[0], received.value
        why_not = order.refusal(value)
        if why_not is not None:
            raise InputError(
                f"{self.name} refuses the fault: {why_not}; the scenario needs one it can make"
            )
        if order.answered_by(value):
            self._orders.popleft()
            self._asked_s, self._sent_s = None, -math.inf  # the next one goes at once


class Breaker:
    """Makes faults happen and end, over one injector per vehicle or by the world.

    `struck` gets each fault once its last order has been confirmed, `mended` each that has ended
    so. The world's orders go to `to_world`, which confirms them by taking them. `signing` makes the
    signing of a link; without it nothing is signed.
    """

    def __init__(
        self,
        scenario: Scenario,
        struck: Report,
        mended: Report,
        to_world: Callable[[Break | Mend], None],
        signing: Callable[[], Signing | None] | None = None,
    ) -> None:
        self._scenario = scenario
        sysid = scenario.links.injector_sysid
        self._injectors = {
            v.sysid: Injector(v.name, v.sysid, sysid, signing and signing()) for v in scenario.fleet
        }
        self._waiting: dict[int, list[tuple[Report, FaultModel]]] = {
            v.sysid: [] for v in scenario.fleet
        }
        self._struck, self._mended, self._to_world = struck, mended, to_world

    @property
    def done(self) -> bool:
        """Every fault asked for is in effect, or over."""
        return not any(self._waiting.values())

    def strike(self, faults: Iterable[FaultModel]) -> None:
        """Ask for faults, from the next step on."""
        for fault in faults:
            self._ask(fault, breaking(self._scenario, fault), Break(fault), self._struck)

    def mend(self, faults: Iterable[FaultModel]) -> None:
        """Ask for the end of faults, from the next step on."""
        for fault in faults:
            self._ask(fault, mending(self._scenario, fault), Mend(fault), self._mended)

    def _ask(
        self, fault: FaultModel, injection: Injection, order: Break | Mend, report: Report
    ) -> None:
        if fault.by_world:
            self._to_world(order)
            report(fault)
        else:
            self._injectors[fault.vehicle].add(injection)
            self._waiting[fault.vehicle].append((report, fault))

    def step(self, now_s: float, sysid: int, datagrams: Iterable[bytes]) -> list[bytes]:
        """What has come from a vehicle's injector port; returns what goes there.

        Raises InputError when it refuses, ProcessDiedError when it does not answer for 10 s.
        """
        injector = self._injectors[sysid]
        outgoing = injector.step(now_s, datagrams)
        if injector.done:
            done, self._waiting[sysid] = self._waiting[sysid], []
            for report, fault in done:
                report(fault)
        return outgoing
