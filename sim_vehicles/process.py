"""`sim-vehicle SCENARIO --sysid N`: the thin shell with sockets, wall clock and signals."""

import argparse
import select
import signal
import socket
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from hil.errors import HilError, InputError
from hil.impairment import impaired
from hil.link import (
    INJECTOR_PORT_BASE,
    MAVLINK_PORT_BASE,
    PHYSICS_PORT_BASE,
    Address,
    Link,
    UdpHub,
    UdpLink,
    is_here,
)
from hil.mavlink import Decoder, Signing, Streams, read_key, ticks
from hil.options import Parser, port
from hil.physics_link import PhysicsState
from hil.scenario import PORTS_PER_VEHICLE, Scenario, load_scenario
from sim_vehicles.parameter_file import restored, written
from sim_vehicles.physics_end import PhysicsEnd
from sim_vehicles.vehicle import Vehicle

REPEAT_AFTER_S = 1.0


class StopRequested(Exception):  # noqa: N818 - not an error
    """SIGTERM or SIGINT: stop tidily."""


def main(argv: Sequence[str] | None = None) -> None:
    try:
        arguments = _parser().parse_args(argv)
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


def _parser() -> Parser:
    parser = Parser(
        prog="sim-vehicle",
        description="One simulated vehicle: speaks MAVLink as ArduPilot Rover does.",
    )
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--sysid", type=int, required=True, help="which vehicle of the fleet")
    parser.add_argument("--host", help="where world and station are (default: links.host)")
    parser.add_argument("--physics-port", type=port, metavar="P", help=_default(PHYSICS_PORT_BASE))
    parser.add_argument("--mavlink-port", type=port, metavar="P", help=_default(MAVLINK_PORT_BASE))
    parser.add_argument(
        "--injector-port", type=port, metavar="P", help=_default(INJECTOR_PORT_BASE)
    )
    parser.add_argument(
        "--listen-port", type=port, metavar="P", default=0, help="where other stations find it"
    )
    parser.add_argument("--params", type=Path, metavar="FILE", help="keep changed parameters there")
    parser.add_argument(
        "--signing-key", type=Path, metavar="FILE", help="sign MAVLink with the pass phrase in it"
    )
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides")
    parser.add_argument("--seed", type=int, help="the same as --set seed=N")
    return parser


def _default(base: int) -> str:
    return f"default: {base} + {PORTS_PER_VEHICLE} x place in the fleet, or by the scenario's links"


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
    offset = PORTS_PER_VEHICLE * sysids.index(arguments.sysid)
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
    signing_for = arguments.signing_key and signer(arguments.signing_key)
    vehicle = Vehicle(scenario, arguments.sysid, signing_for)
    keeper = None if arguments.params is None else ParameterKeeper(arguments.params, vehicle)
    welcome = _welcome(signing_for, vehicle)
    with ExitStack() as stack:
        physics = UdpLink.connect(host, ports.physics)
        stack.callback(physics.close)
        gcs = _hub((host, ports.mavlink), arguments.listen_port, welcome)
        stack.callback(gcs.close)
        injector = _bound(host, ports.injector)
        injector.guard(welcome)
        stack.callback(injector.close)
        if not is_here(host):
            print(f"listens to other machines, too, for {host}", file=sys.stderr, flush=True)
        shell = Shell(vehicle, scenario, physics, gcs, injector, keeper)
        print("ready", flush=True)
        shell.serve()


SigningFor = Callable[[int], Signing]


def signer(path: Path) -> SigningFor:
    """Signing for each link with the pass phrase in a file, on the wall clock."""
    key, streams = read_key(path), Streams()
    return lambda link_id: Signing(key, link_id, lambda: ticks(time.time()), streams)


def _welcome(signing_for: SigningFor | None, vehicle: Vehicle) -> Callable[[bytes], bool]:
    """Whether a stranger's datagram is valid, and signed where that is asked for."""
    decoder = Decoder(signing_for(0) if signing_for else None, vehicle.hears_unsigned)
    return lambda datagram: bool(decoder.peek(datagram))


def _hub(host: Address, port: int, welcome: Callable[[bytes], bool]) -> UdpHub:
    """Strangers have to be welcome before they are listened to."""
    try:
        return UdpHub.open(host, port, welcome)
    except OSError as error:
        raise InputError(
            f"--listen-port {port} cannot be bound: {error.strerror}; choose another"
        ) from None


class ParameterKeeper:
    """Keeps changed parameters in a file: read at the start, written after each change."""

    def __init__(self, path: Path, vehicle: Vehicle) -> None:
        self._path, self._parameters = path, vehicle.parameters
        try:
            text = path.read_text(encoding="utf-8") if path.exists() else ""
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"--params {path}: cannot be read: {error}") from None
        for complaint in restored(self._parameters, text):
            print(f"{path}: {complaint}", file=sys.stderr, flush=True)
        self._revision = self._parameters.revision

    def keep(self) -> None:
        """Write what has changed, whole or not at all."""
        if self._parameters.revision == self._revision:
            return
        self._revision = self._parameters.revision
        draft = self._path.with_name(self._path.name + ".new")
        try:
            draft.write_text(written(self._parameters), encoding="utf-8")
            draft.replace(self._path)
        except OSError as error:
            print(f"{self._path}: cannot be written: {error}", file=sys.stderr, flush=True)


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
        gcs: UdpHub,
        injector: UdpLink,
        keeper: ParameterKeeper | None,
    ) -> None:
        self._vehicle, self._physics, self._scenario = vehicle, physics, scenario
        self._end = PhysicsEnd(scenario.clock.autopilot_hz)
        self._gcs, self._injector, self._keeper = gcs, injector, keeper
        self._radios: dict[int, Link] = {0: self._radio(0)}

    def serve(self) -> None:
        """Frame after frame, for ever."""
        pwm_us: tuple[int, ...] = ()
        while True:
            pwm_us = self._vehicle.step(self._exchange(self._end.frame(pwm_us)))
            self._send_mavlink()

    def _exchange(self, frame: bytes) -> PhysicsState:
        """Send a frame and wait for its reply, repeating the frame each second."""
        sources = [link.fileno() for link in (self._physics, self._gcs, self._injector)]
        repeat_s = 0.0
        while True:
            now_s = time.monotonic()
            if now_s >= repeat_s:
                self._physics.send(frame)
                repeat_s = now_s + REPEAT_AFTER_S
            select.select(sources, [], [], repeat_s - now_s)
            self._receive_mavlink()
            state = self._end.accept(self._physics.receive())
            if state is not None:
                return state

    def _receive_mavlink(self) -> None:
        self._meet()
        for peer, radio in self._radios.items():
            for datagram in radio.receive():
                self._vehicle.receive("gcs", datagram, peer)
        for datagram in self._injector.receive():
            self._vehicle.receive("injector", datagram)
        self._send_mavlink()
        if self._keeper is not None:
            self._keeper.keep()

    def _meet(self) -> None:
        """Stations that come get a link, and those that have gone are forgotten."""
        peers = self._gcs.peers()
        if self._radios.keys() != set(peers):
            self._radios = {p: self._radios.get(p) or self._radio(p) for p in peers}
            self._vehicle.keep(peers)

    def _radio(self, peer: int) -> Link:
        end, vehicle = self._gcs.end(peer), self._vehicle
        return impaired(end, self._scenario, vehicle.sysid, lambda: vehicle.time_s)

    def _send_mavlink(self) -> None:
        for peer, radio in self._radios.items():
            for datagram in self._vehicle.outbox("gcs", peer):
                radio.send(datagram)
        for datagram in self._vehicle.outbox("injector"):
            self._injector.send(datagram)


if __name__ == "__main__":
    main()
