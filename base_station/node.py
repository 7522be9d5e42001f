"""The station on its links: bytes to typed values, the step, and bytes again; and its listeners.

The same node runs over UDP (`process.py`) and over memory. All that it tells the outside goes to
listeners, which only listen. What it does depends on the inputs of its steps alone. They go to a
journal before the step; `replay` takes them from there, tells nobody, and believes the same again.
"""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

from base_station.commands import Command, encode
from base_station.field.safety import disarm_all, stop_all
from base_station.journal import Datagrams, Inputs
from base_station.listening import Listener, Listeners
from base_station.outcome import PhaseTimes, outcome, training
from base_station.phases import Connecting
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest
from base_station.records import Event
from base_station.refusals import Refusals
from base_station.station import Outputs, Station
from hil.link import Link
from hil.mavlink import (
    COMPONENT_AUTOPILOT,
    COMPONENT_GCS,
    Decoder,
    Encoder,
    Heartbeat,
    Received,
    Signing,
    ticks,
)
from hil.scenario import StationView

REPEATS = 3  # of what is said only once
LINGER_S = 1.0  # after the end, until every vehicle has confirmed HOLD

Heard = list[tuple[int, Received]]


class Planner(Protocol):
    """Where plan requests go, and what has come back."""

    def submit(self, request: PlanRequest) -> None: ...

    def poll(self) -> list[PlanProgress | PlanReady]: ...


class Keeper(Protocol):
    """A journal. Its methods may raise OSError."""

    @property
    def is_long(self) -> bool:
        """Whether one that only waits should begin anew."""

    def begin_anew(self) -> None:
        """What comes from here on is a fresh station's."""

    def inputs(self, inputs: Inputs) -> None:
        """Before a step."""

    def outputs(self, sent: Datagrams, events: Sequence[Event]) -> None:
        """After it, before anything is sent."""


class StationNode:
    """One station with a link per vehicle, in fleet order. With a `key` all of them are signed."""

    def __init__(
        self,
        view: StationView,
        links: Sequence[Link],
        planner: Planner,
        listeners: Sequence[Listener],
        journal: Keeper | None = None,
        key: bytes | None = None,
        station: Station | None = None,
    ) -> None:
        self.station = station or Station(view)
        self._sysids = [m.sysid for m in view.fleet]
        self._links, self._planner, self._journal = links, planner, journal
        self._listeners = Listeners(listeners)
        self._epoch_us = 0
        signings = [self._signing(key, index) for index in range(len(view.fleet))]
        self._decoders = [Decoder(signing) for signing in signings]
        self._encoders = [Encoder(view.station_sysid, COMPONENT_GCS, s) for s in signings]
        self._refusals = Refusals(view)
        self._phases = PhaseTimes()
        self._trainings: list[dict[str, Any]] = []
        self._waiting: PlanRequest | None = None
        self._ended_s: float | None = None
        self._given_back = False
        self.finished = False

    def step(self, wall_s: float, epoch_us: int) -> None:
        """Receive, decide, send. `epoch_us` stamps logs and signatures."""
        self._epoch_us = epoch_us
        datagrams, heard = self._receive()
        inputs = Inputs(wall_s, epoch_us, datagrams, self._answers(), self._given_back)
        self._given_back = False
        self._keep(self._forget_the_wait)
        self._keep(lambda journal: journal.inputs(inputs))
        out = self._advance(inputs, heard)
        sent = tuple(self._encoded(out))
        self._keep(lambda journal: journal.outputs(sent, out.events))
        for index, datagram in sent:
            self._links[index].send(datagram)
        self._tell(sent, out)
        if out.request is not None:
            self._planner.submit(out.request)
        self._finish()
        if self._listeners.failure and not self.station.desk.ended:
            self.station.desk.stop(self._listeners.failure)

    def replay(self, inputs: Inputs) -> Sequence[Event]:
        """A step of the journal again; what it would send is dropped, what it says is returned."""
        self._epoch_us = inputs.epoch_us
        heard = [(i, m) for i, data in inputs.datagrams for m in self._decoders[i].decode(data)]
        self._trainings += map(training, inputs.answers)
        return self._advance(inputs, heard).events

    def take_over(
        self,
        links: Sequence[Link],
        planner: Planner,
        listeners: Sequence[Listener],
        journal: Keeper | None,
    ) -> None:
        """From a replay to life: the planner is asked again what it had not answered."""
        self._links, self._planner, self._journal = links, planner, journal
        self._listeners = Listeners(listeners)
        if self._waiting is not None:
            planner.submit(self._waiting)

    def hold_all(self) -> None:
        """Everybody stands, whatever the station had in mind: it is about to go."""
        view = self.station.desk.view
        self._say_at_once(stop_all(view, self.station.autopilots))

    def give_back(self) -> None:
        """Vehicles that were taken over are the station's again, from the next step on."""
        self._given_back = True

    def emergency_stop(self) -> None:
        """Motors off."""
        self._say_at_once(disarm_all(self.station.desk.view))

    def _say_at_once(self, commands: Sequence[Command]) -> None:
        """Three times: the station will not see whether it was heard."""
        for command in (*commands,) * REPEATS:
            index = self._sysids.index(command.sysid)
            autopilot = self.station.autopilots[index]
            datagram = encode(command, self._encoders[index], autopilot)
            self._links[index].send(datagram)
            self._log(index, datagram)

    def is_welcome(self, index: int, datagram: bytes) -> bool:
        """Whether what comes from a new address is that vehicle's heartbeat, signed if need be."""
        return any(
            (m.sysid, m.compid) == (self._sysids[index], COMPONENT_AUTOPILOT)
            and isinstance(m.value, Heartbeat)
            for m in self._decoders[index].peek(datagram)
        )

    def hear_of(self, index: int, sysid: int) -> None:
        """Somebody who is not of the fleet speaks where a vehicle should."""
        if sysid == self.station.desk.view.station_sysid:
            self._refusals.namesake(index)

    def _signing(self, key: bytes | None, index: int) -> Signing | None:
        """On the clock of the steps, so that a replay judges stamps as it did the first time."""
        if key is None:
            return None
        return Signing(key, index % 256, lambda: ticks(self._epoch_us / 1e6))

    def _receive(self) -> tuple[Datagrams, Heard]:
        """The datagrams that said something, and what they said; logs get all of them."""
        kept: list[tuple[int, bytes]] = []
        heard: Heard = []
        for index, (link, decoder) in enumerate(zip(self._links, self._decoders, strict=True)):
            for datagram in link.receive():
                self._log(index, datagram)
                messages = decoder.decode(datagram)
                if messages:
                    kept.append((index, datagram))
                    heard += [(index, message) for message in messages]
        return tuple(kept), heard

    def _advance(self, inputs: Inputs, heard: Heard) -> Outputs:
        if inputs.given_back:
            self.station.give_back()
        out = self.station.step(inputs.wall_s, heard, inputs.answers)
        if out.request is not None:
            self._waiting = out.request
        elif self._waiting and any(a.number == self._waiting.number for a in inputs.answers):
            self._waiting = None
        desk = self.station.desk
        self._phases.at(desk.phase.name, inputs.wall_s, desk.time_s)
        if desk.ended and self._ended_s is None:
            self._ended_s = desk.time_s
        return out

    def _encoded(self, out: Outputs) -> list[tuple[int, bytes]]:
        sent = []
        for command in out.commands:
            index = self._sysids.index(command.sysid)
            sent.append(
                (index, encode(command, self._encoders[index], self.station.autopilots[index]))
            )
        return sent

    def _tell(self, sent: Datagrams, out: Outputs) -> None:
        for index, datagram in sent:
            self._log(index, datagram)
        desk = self.station.desk
        refused = self._refusals.told(self._decoders, desk.time_s, self._epoch_us)
        for event in (*out.events, *refused):
            self._listeners.event(event)
        for snapshot in out.snapshots:
            self._listeners.snapshot(snapshot)

    def _answers(self) -> tuple[PlanReady, ...]:
        answers = []
        for message in self._planner.poll():
            if isinstance(message, PlanReady):
                answers.append(message)
                self._trainings.append(training(message))
                self._listeners.plan(message)
            else:
                self._listeners.progress(message)
        return tuple(answers)

    def _finish(self) -> None:
        if self._ended_s is None or self.finished:
            return
        if self.station.desk.time_s - self._ended_s >= LINGER_S:
            self.finished = True
            told = outcome(self.station.desk, self._phases, self._trainings)
            self._listeners.result(told)

    def _keep(self, call: Callable[[Keeper], None]) -> None:
        """A journal that cannot be written any more is left, and the fleet brought to a hold."""
        if self._journal is None:
            return
        try:
            call(self._journal)
        except OSError as error:
            self._journal = None
            self._listeners.fail("the journal", error)

    def _forget_the_wait(self, journal: Keeper) -> None:
        if journal.is_long and isinstance(self.station.desk.phase, Connecting):
            journal.begin_anew()
            self.station = Station(self.station.desk.view)

    def _log(self, index: int, datagram: bytes) -> None:
        self._listeners.datagram(index, self._epoch_us, datagram)
