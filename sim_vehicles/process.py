"""`sim-vehicle SCENARIO --sysid N`: the thin shell with sockets, wall clock and signals."""

import argparse
import select
import signal
import socket
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from hil.errors import HilError, InputError
from hil.impairment import impaired
from hil.link import INJECTOR_PORT_BASE, MAVLINK_PORT_BASE, PHYSICS_PORT_BASE, Link, UdpLink
from hil.physics_link import PhysicsState
from hil.scenario import Scenario, load_scenario
from sim_vehicles.physics_end import PhysicsEnd
from sim_vehicles.vehicle import PortName, Vehicle

REPEAT_AFTER_S = 1.0
PORT_STEP = 10


class StopRequested(Exception):  # noqa: N818 - not an error
    """SIGTERM or SIGINT: stop tidily."""


def main(argv: Sequence[str] | None = None) -> None:
    arguments = _parser().parse_args(argv)
    try:
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, _terminate)
        run(arguments)
    except StopRequested:
        sys.exit(0)
    except HilError as error:
        print(f"sim-vehicle: {error}", file=sys.stderr)
        sys.exit(error.exit_code)


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise StopRequested


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="sim-vehicle",
        description="One simulated vehicle: speaks MAVLink as ArduPilot Rover does.",
    )
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--sysid", type=int, required=True, help="which vehicle of the fleet")
    parser.add_argument("--host", help="where world and station are (default: links.host)")
    parser.add_argument("--physics-port", type=_port, metavar="P", help=_default(PHYSICS_PORT_BASE))
    parser.add_argument("--mavlink-port", type=_port, metavar="P", help=_default(MAVLINK_PORT_BASE))
    parser.add_argument(
        "--injector-port", type=_port, metavar="P", help=_default(INJECTOR_PORT_BASE)
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides")
    parser.add_argument("--seed", type=int, help="the same as --set seed=N")
    return parser


def _port(text: str) -> int:
    port = int(text)  # argparse words the ValueError
    if not 1 <= port <= 65535:
        raise argparse.ArgumentTypeError(f"{text}: a port is 1 to 65535")
    return port


def _default(base: int) -> str:
    return f"default: {base} + {PORT_STEP} x place in the fleet, or as the scenario's links say"


@dataclass(frozen=True)
class Ports:
    """UDP ports of one vehicle: two to connect to, and the injector's to listen on."""

    physics: int
    mavlink: int
    injector: int


def ports_of(scenario: Scenario, arguments: argparse.Namespace) -> Ports:
    """Given on the command line, or else by the scenario's base and the place in the fleet."""
    links = scenario.links
    sysids = [v.sysid for v in scenario.fleet]
    offset = PORT_STEP * sysids.index(arguments.sysid)
    return Ports(
        arguments.physics_port or (links.physics_port_base or PHYSICS_PORT_BASE) + offset,
        arguments.mavlink_port or (links.mavlink_port_base or MAVLINK_PORT_BASE) + offset,
        arguments.injector_port or (links.injector_port_base or INJECTOR_PORT_BASE) + offset,
    )


def run(arguments: argparse.Namespace) -> None:
    """Serve until a signal. Raises InputError for bad input, ProcessDiedError for a lost world."""
    seed = [] if arguments.seed is None else [f"seed={arguments.seed}"]
    scenario = load_scenario(arguments.scenario, [*arguments.overrides, *seed])
    sysids = [v.sysid for v in scenario.fleet]
    if arguments.sysid not in sysids:
        raise InputError(f"--sysid {arguments.sysid} is not in the fleet; it has {sysids}")
    host = _resolved(arguments.host or scenario.links.host)
    ports = ports_of(scenario, arguments)
    with ExitStack() as stack:
        physics = UdpLink.connect(host, ports.physics)
        stack.callback(physics.close)
        gcs = UdpLink.connect(host, ports.mavlink)
        stack.callback(gcs.close)
        injector = _bound(host, ports.injector)
        stack.callback(injector.close)
        shell = Shell(Vehicle(scenario, arguments.sysid), scenario, physics, gcs, injector)
        print("ready", flush=True)
        shell.serve()


def _resolved(host: str) -> str:
    try:
        return socket.gethostbyname(host)
    except OSError as error:
        raise InputError(f"--host {host}: {error.strerror}; give a name or address") from None


def _bound(host: str, port: int) -> UdpLink:
    try:
        return UdpLink.bind(host, port)
    except (OSError, OverflowError) as error:
        raise InputError(
            f"injector port {host}:{port} cannot be bound: {error}; choose another --injector-port"
        ) from None


class Shell:
    """A vehicle with its three sockets. MAVLink is answered while physics is waited for."""

    def __init__(
        self,
        vehicle: Vehicle,
        scenario: Scenario,
        physics: UdpLink,
        gcs: UdpLink,
        injector: UdpLink,
    ) -> None:
        self._vehicle, self._physics = vehicle, physics
        self._end = PhysicsEnd(scenario.clock.autopilot_hz)
        self._sources = (physics, gcs, injector)
        radio = impaired(gcs, scenario, vehicle.sysid, lambda: vehicle.time_s)
        self._mavlink: dict[PortName, Link] = {"gcs": radio, "injector": injector}

    def serve(self) -> None:
        """Frame after frame, for ever."""
        pwm_us: tuple[int, ...] = ()
        while True:
            pwm_us = self._vehicle.step(self._exchange(self._end.frame(pwm_us)))
            self._send_mavlink()

    def _exchange(self, frame: bytes) -> PhysicsState:
        """Send a frame and wait for its reply, repeating the frame each second."""
        repeat_s = 0.0
        while True:
            now_s = time.monotonic()
            if now_s >= repeat_s:
                self._physics.send(frame)
                repeat_s = now_s + REPEAT_AFTER_S
            select.select(self._sources, [], [], repeat_s - now_s)
            self._receive_mavlink()
            state = self._end.accept(self._physics.receive())
            if state is not None:
                return state

    def _receive_mavlink(self) -> None:
        for port, link in self._mavlink.items():
            for datagram in link.receive():
                self._vehicle.receive(port, datagram)
        self._send_mavlink()

    def _send_mavlink(self) -> None:
        for port, link in self._mavlink.items():
            for datagram in self._vehicle.outbox(port):
                link.send(datagram)


if __name__ == "__main__":
    main()
