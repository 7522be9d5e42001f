"""TIMESYNC and PING."""

from hil.mavlink import Ping, Timesync
from sim_vehicles.services.service import Handlers, Replies, Request


def handlers() -> Handlers:
    return {Timesync: _timesync, Ping: _ping}


def _timesync(request: Request) -> Replies:
    """tc1 = 0 asks for our time in ns since boot; anything else answers a question not asked."""
    value: Timesync = request.value
    if value.tc1_ns != 0:
        return []
    return [Timesync(max(1, round(request.now_s * 1e9)), value.ts1_ns)]


def _ping(request: Request) -> Replies:
    value: Ping = request.value
    if value.target_sysid != 0:
        return []
    return [Ping(value.time_usec, value.seq, request.sysid, request.compid)]
