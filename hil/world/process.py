"""The world process: sockets, pacing and signals around `Simulation`."""

import os
import select
import signal
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, closing, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TextIO

from hil.errors import InputError, ProcessDiedError
from hil.link import PHYSICS_PORT_BASE, UdpLink, is_here
from hil.scenario import Scenario
from hil.world.orders import OrderReader, Until
from hil.world.pacing import Leash, Pace
from hil.world.simulation import Advance, Simulation
from hil.world.truth import contact_line, truth_line

FIRST_FRAMES_WITHIN_S = 30.0
_POLL_S = 0.1


@dataclass(frozen=True)
class WorldOptions:
    """As on the command line. `truth` is a path, '-' for stdout, or None for nowhere."""

    speed: float = 1.0
    physics_port: int | None = None
    host: str | None = None
    truth: str | None = None
    leash: bool = False


def run_world(scenario: Scenario, options: WorldOptions) -> int:
    """Serve until SIGTERM or SIGINT. Raises InputError and ProcessDiedError."""
    host = options.host or scenario.links.host
    base = options.physics_port or scenario.links.physics_port_base or PHYSICS_PORT_BASE
    ports = {v.sysid: base + 10 * i for i, v in enumerate(scenario.fleet)}
    names = {v.sysid: f"{v.name} (sysid {v.sysid}, port {ports[v.sysid]})" for v in scenario.fleet}
    with ExitStack() as stack:
        links = {sysid: _bind(stack, host, port) for sysid, port in ports.items()}
        if not is_here(host):
            print(f"listens to other machines, too: {host}", file=sys.stderr, flush=True)
        file = stack.enter_context(_open_truth(options.truth))
        leash = Leash(0.0) if options.leash else None
        simulation, pace = Simulation(scenario, scenario.seed), Pace(options.speed)
        for sysid, link in links.items():
            link.guard(simulation.wires[sysid].is_welcome)
        _Server(simulation, links, names, partial(_write_truth, file), pace, leash).serve()
    return 0


def _bind(stack: ExitStack, host: str, port: int) -> UdpLink:
    try:
        return stack.enter_context(closing(UdpLink.bind(host, port)))
    except (OSError, OverflowError) as error:
        raise InputError(
            f"physics port {host}:{port} cannot be bound: {error}; "
            "choose another --physics-port, or stop who uses it"
        ) from None


def _open_truth(target: str | None) -> AbstractContextManager[TextIO | None]:
    if target is None:
        return nullcontext(None)
    if target == "-":
        return nullcontext(sys.stdout)
    try:
        return Path(target).open("w", encoding="utf-8")
    except OSError as error:
        raise InputError(f"--truth {target}: cannot be written: {error.strerror}") from None


def _write_truth(file: TextIO | None, advance: Advance) -> None:
    lines = [truth_line(t) for t in advance.truth] + [contact_line(c) for c in advance.contacts]
    if file is not None and lines:
        file.write("\n".join(lines) + "\n")
        file.flush()


@dataclass
class _Server:
    """The loop. With a leash the world belongs to `hil run`, and a silent vehicle ends it."""

    simulation: Simulation
    links: dict[int, UdpLink]
    names: dict[int, str]
    record: Callable[[Advance], None]
    pace: Pace
    leash: Leash | None = None
    stopping: bool = False
    started_s: float = field(default_factory=time.monotonic)
    orders: OrderReader = field(default_factory=OrderReader)

    def serve(self) -> None:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._stop)
        print("ready", flush=True)
        while not self.stopping:
            self._receive()
            self._obey()
            now_s = time.monotonic()
            self._check_presence(now_s)
            wait_s = self._wait_s(now_s)
            if wait_s > 0.0:
                self._sleep(wait_s)
                continue
            advance = self.simulation.advance(self._until_s(), now_s)
            for sysid, reply in advance.replies:
                self.links[sysid].send(reply)
            self.record(advance)
        self.record(self.simulation.close())

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self.stopping = True

    def _until_s(self) -> float:
        return self.leash.until_s if self.leash else float("inf")

    def _receive(self) -> None:
        now_s = time.monotonic()
        for sysid, link in self.links.items():
            for to, reply in self.simulation.receive(sysid, link.receive(), now_s):
                self.links[to].send(reply)

    def _wait_s(self, now_s: float) -> float:
        if not self.simulation.may_step(self._until_s()):
            return _POLL_S
        return self.pace.wait_s(self.simulation.time_s, now_s)

    def _sleep(self, wait_s: float) -> None:
        """Until something arrives or the time is up."""
        sources: list[UdpLink | int] = list(self.links.values())
        if self.leash:
            sources.append(0)
        select.select(sources, [], [], min(wait_s, _POLL_S))

    def _obey(self) -> None:
        """Orders from whoever holds the leash, as soon as they come."""
        if self.leash is None or not select.select([0], [], [], 0.0)[0]:
            return
        data = os.read(0, 65536)
        self.stopping = self.stopping or not data  # whoever held the leash is gone
        for order in self.orders.feed(data):
            if isinstance(order, Until):
                self.leash.lengthen(order.time_s)
            else:
                self.simulation.obey(order)

    def _check_presence(self, now_s: float) -> None:
        absent = self.simulation.lockstep.absent()
        if absent and now_s - self.started_s > FIRST_FRAMES_WITHIN_S:
            raise ProcessDiedError(
                f"no first frame from {self._named(absent)} within {FIRST_FRAMES_WITHIN_S:.0f} s; "
                "start its sim-vehicle, or autopilot, with this physics port"
            )
        silent = self.simulation.lockstep.silent(now_s)
        if silent and self.leash:
            raise ProcessDiedError(f"{self._named(silent)} is silent for 2 s on the physics link")
        for sysid in silent:
            self.simulation.lockstep.lose(sysid)
            print(
                f"{self.names[sysid]} has been silent for 2 s; its body stays without power "
                "until it comes back",
                file=sys.stderr,
                flush=True,
            )

    def _named(self, sysids: tuple[int, ...]) -> str:
        return ", ".join(self.names[s] for s in sysids)
