"""Ports that a process under test is told to bind: free now, and not taken by chance later."""

import random
import socket
from contextlib import ExitStack

_SEARCH = range(10_000, 32_000)  # below the range from which systems pick ports for clients
_TRIES = 200


def free_ports(
    count: int, step: int = 1, kind: socket.SocketKind = socket.SOCK_DGRAM
) -> tuple[int, ...]:
    """`count` ports of 127.0.0.1, `step` apart."""
    for _ in range(_TRIES):
        base = random.choice(_SEARCH)
        ports = tuple(range(base, base + step * count, step))
        with ExitStack() as held:
            try:
                for port in ports:
                    probe = held.enter_context(socket.socket(socket.AF_INET, kind))
                    probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return ports
    raise AssertionError(f"no {count} free ports")
