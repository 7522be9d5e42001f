"""What a service is: handlers from a request to the messages that answer it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hil.mavlink import Message


@dataclass(frozen=True, slots=True)
class Request:
    """A message with who sent it, and the vehicle time (s) it arrived at.

    `value` has the type its handler is registered for.
    """

    now_s: float
    sysid: int
    compid: int
    value: Any


Replies = list[Message]
Handler = Callable[[Request], Replies]
Handlers = Mapping[type[Message], Handler]


def merged(*tables: Handlers) -> dict[type[Message], Handler]:
    """One table of handlers; each message type belongs to one service."""
    table: dict[type[Message], Handler] = {}
    for handlers in tables:
        twice = table.keys() & handlers.keys()
        if twice:
            raise ValueError(f"two services answer {', '.join(t.__name__ for t in twice)}")
        table.update(handlers)
    return table
