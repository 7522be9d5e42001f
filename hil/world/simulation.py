"""Space and lockstep together: datagrams in, datagrams and truth out (pure; time is passed in)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from hil.faults import to_clearing, to_injection
from hil.scenario import Scenario
from hil.world.lockstep import Lockstep
from hil.world.orders import Break, Mend
from hil.world.powering import Powering
from hil.world.space import World
from hil.world.tampering import Tampering
from hil.world.truth import ContactEpisode, ContactLog, TruthRecord
from hil.world.wires import wire_of

TRUTH_HZ = 10

Reply = tuple[int, bytes]  # system id, datagram


@dataclass(frozen=True)
class Advance:
    """What one advance brought: replies to send, truth to record, contacts that are over."""

    replies: tuple[Reply, ...] = ()
    truth: tuple[TruthRecord, ...] = ()
    contacts: tuple[ContactEpisode, ...] = ()


class Simulation:
    """The world as its vehicles meet it. `now_s` is any monotonic wall time."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.world = World(scenario, seed)
        self.lockstep = Lockstep(tuple(v.sysid for v in scenario.fleet), scenario.clock.physics_hz)
        self._tampering = {v.sysid: Tampering(v.frame) for v in scenario.fleet}
        self.wires = {v.sysid: wire_of(v, scenario) for v in scenario.fleet}
        self._powering = Powering(scenario.fleet)
        self._contact_log = ContactLog()
        self._samples = 0  # truth records made so far

    @property
    def time_s(self) -> float:
        return self.world.time_s

    def receive(self, sysid: int, datagrams: Sequence[bytes], now_s: float) -> tuple[Reply, ...]:
        """Take what a vehicle sent; returns cached replies that have to go out again."""
        again = [
            self.lockstep.receive(sysid, frame, self.world.steps, now_s)
            for datagram in datagrams
            for frame in self.wires[sysid].frames(datagram)
        ]
        return tuple((sysid, reply) for reply in again if reply is not None)

    def obey(self, order: Break | Mend) -> None:
        """From the next step on. Raises ValueError for a fault that can't be put in effect."""
        match order:
            case Break(fault):
                injection = to_injection(fault.fault())
            case Mend(fault):
                injection = to_clearing(fault.fault().unit, fault.instances)
        self._tampering[order.fault.vehicle].inject(injection, self.time_s)

    def may_step(self, until_s: float) -> bool:
        """Every vehicle has joined, nobody owes a frame, and a step more is not too far."""
        joined = not self.lockstep.absent() and self.lockstep.may_step()
        return joined and self.world.steps < self._last_step(until_s)

    def advance(self, until_s: float, now_s: float) -> Advance:
        """Step to the next answer, never beyond `until_s`. Call it when `may_step(until_s)`."""
        truth = self._sample()
        contacts: list[ContactEpisode] = []
        target = min(self.lockstep.next_answer(), self._last_step(until_s))
        outputs = {
            sysid: self._tampering[sysid].outputs(pwm_us, self.time_s)
            for sysid, pwm_us in self._powering.outputs(self.lockstep.outputs()).items()
        }
        while self.world.steps < target:
            self.world.step(outputs)
            contacts += self._contact_log.add(self.time_s, self.world.contacts())
            truth += self._sample()
        return Advance(self._answer(now_s), truth, tuple(contacts))

    def close(self) -> Advance:
        """The last truth and the contacts still open."""
        return Advance((), (self.world.truth(),), self._contact_log.close())

    def _last_step(self, until_s: float) -> float:
        """The last whole step that ends by `until_s`; decimal times may be a hair too small."""
        steps = until_s * self.world.physics_hz + 1e-6
        return math.floor(steps) if math.isfinite(steps) else steps

    def _answer(self, now_s: float) -> tuple[Reply, ...]:
        replies = []
        for sysid in self.lockstep.answers_due(self.world.steps):
            told = self._tampering[sysid].told(self.world.state(sysid))
            reply = self.wires[sysid].reply(told)
            self.lockstep.answered(sysid, reply, now_s)
            replies.append((sysid, reply))
        return tuple(replies)

    def _sample(self) -> tuple[TruthRecord, ...]:
        if self.world.steps * TRUTH_HZ < self._samples * self.world.physics_hz:
            return ()
        self._samples += 1
        return (self.world.truth(),)
