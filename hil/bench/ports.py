"""Ports for a run: pinned ones are checked, others are found free."""

import errno
import random
import socket
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass

from hil.errors import InputError
from hil.scenario import PORTS_PER_VEHICLE, Scenario

_SEARCH = range(10_000, 32_000)  # below the range from which systems pick ports for clients
_TRIES = 200


@dataclass(frozen=True)
class PortBases:
    """Vehicle i uses base + 10 i."""

    physics: int
    mavlink: int
    injector: int


def choose_ports(scenario: Scenario) -> PortBases:
    """All three bases; raises InputError when a pinned port is busy, or the host is not ours."""
    links, count = scenario.links, len(scenario.fleet)
    pinned = {
        "physics_port_base": links.physics_port_base,
        "mavlink_port_base": links.mavlink_port_base,
        "injector_port_base": links.injector_port_base,
    }
    with ExitStack() as held:
        for field, base in pinned.items():
            if base is not None:
                _hold_pinned(held, links.host, field, _ports(base, count))
        chosen = {
            field: _find(held, links.host, count) if base is None else base
            for field, base in pinned.items()
        }
    return PortBases(*chosen.values())


def _ports(base: int, count: int) -> range:
    return range(base, base + PORTS_PER_VEHICLE * count, PORTS_PER_VEHICLE)


def _hold_pinned(held: ExitStack, host: str, field: str, ports: Iterable[int]) -> None:
    for port in ports:
        try:
            _hold(held, host, port)
        except (OSError, OverflowError) as error:
            why = "is busy" if getattr(error, "errno", 0) == errno.EADDRINUSE else str(error)
            raise InputError(
                f"links.{field}: UDP port {host}:{port} {why}; stop who uses it, pin another "
                "base, or leave the field out to get free ports"
            ) from None


def _find(held: ExitStack, host: str, count: int) -> int:
    for _ in range(_TRIES):
        base = random.choice(_SEARCH)
        with ExitStack() as attempt:
            try:
                for port in _ports(base, count):
                    _hold(attempt, host, port)
            except OSError as error:
                if error.errno != errno.EADDRINUSE:
                    raise InputError(
                        f"links.host = {host!r} cannot be bound: {error.strerror}; "
                        "use an address of this machine, as 127.0.0.1"
                    ) from None
                continue
            held.push(attempt.pop_all())
            return base
    raise InputError(f"no {count} free UDP ports found on {host}; stop what uses them")


def _hold(held: ExitStack, host: str, port: int) -> None:
    sock = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    sock.bind((host, port))
