"""The links to a fleet, opened: one carrier for each connection, one end for each vehicle."""

from contextlib import ExitStack

from hil.carriers import open_carrier
from hil.connection import Connection
from hil.router import Router, RouterEnd
from hil.scenario import StationView


def open_links(stack: ExitStack, view: StationView) -> list[RouterEnd]:
    """Ends in fleet order; leaving `stack` closes them. Raises InputError."""
    routers: dict[Connection, Router] = {}
    ends = []
    for member in view.fleet:
        connection = view.connection_of(member)
        if connection not in routers:
            routers[connection] = Router(open_carrier(connection))
            stack.callback(routers[connection].close)
        ends.append(routers[connection].end(member.sysid))
    return ends
