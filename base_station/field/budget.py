"""What a fleet's messages take of a serial line, before anything is sent (pure).

Sizes are MAVLink 2 frames: 12 bytes around the payload, untruncated.
"""

from dataclasses import dataclass

from base_station.autopilots import Rate, adapter
from hil.connection import Connection
from hil.errors import InputError
from hil.mavlink import MessageId
from hil.mavlink.frame import payload_bytes
from hil.scenario import StationView

FRAME_BYTES = 12
SHARE = 0.7  # of a line: the rest is for the radio's own words, repeats and answers
UNASKED = (Rate(MessageId.HEARTBEAT, 1.0), Rate(MessageId.TIMESYNC, 1.0))
SENT = (Rate(MessageId.HEARTBEAT, 1.0), Rate(MessageId.TIMESYNC, 1.0))


@dataclass(frozen=True)
class Load:
    """Bytes a second over one line, in both directions together: a radio is half duplex."""

    connection: Connection
    bytes_per_s: float

    @property
    def share(self) -> float:
        """Of what the line carries; 0 where that is no concern."""
        limit = self.connection.bytes_per_s
        return 0.0 if limit is None else self.bytes_per_s / limit


def loads(view: StationView) -> tuple[Load, ...]:
    """One for each connection."""
    totals: dict[Connection, float] = {}
    for member in view.fleet:
        connection = view.connection_of(member)
        down = adapter(member.autopilot, member.frame).rates(view.clock.telemetry_hz)
        setpoints = Rate(MessageId.SET_POSITION_TARGET_LOCAL_NED, view.clock.telemetry_hz)
        total = sum(_bytes(r) for r in (*down, *UNASKED, setpoints))
        totals.setdefault(connection, sum(_bytes(r) for r in SENT))
        totals[connection] += total
    return tuple(Load(connection, total) for connection, total in totals.items())


def refuse_overload(view: StationView) -> None:
    """Raises InputError for a serial line that would be filled over its share."""
    for load in loads(view):
        if load.share > SHARE:
            raise InputError(
                f"connection {load.connection}: {load.bytes_per_s:.0f} bytes/s are "
                f"{100 * load.share:.0f} % of what it carries; {100 * SHARE:.0f} % is safe; "
                "lower clock.telemetry_hz, use a faster line, or one radio for each vehicle"
            )


def _bytes(rate: Rate) -> float:
    return rate.hz * (FRAME_BYTES + payload_bytes(int(rate.message)))
