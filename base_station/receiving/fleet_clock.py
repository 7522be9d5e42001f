"""One time for the whole fleet: the first vehicle's boot time, the others brought to it."""

from collections import deque
from dataclasses import dataclass

KEPT_ROUNDS = 20


@dataclass(frozen=True)
class _Reply:
    boot_ns: int
    round_trip_ns: int


class FleetClock:
    """Offsets between the vehicles' boot clocks, from TIMESYNC asked of all at the same instant.

    Two replies to the same question differ by the offset and by at most their round trips, so
    the round with the smallest sum of round trips counts (minimum round trip filter).
    """

    def __init__(self, sysids: tuple[int, ...]) -> None:
        self._reference = sysids[0]
        self._rounds: dict[int, deque[tuple[int, int]]] = {
            s: deque(maxlen=KEPT_ROUNDS) for s in sysids
        }  # (summed round trips, offset), ns
        self._open: dict[int, dict[int, _Reply]] = {}

    def reply(self, sysid: int, tc1_ns: int, ts1_ns: int, now_ns: int) -> None:
        """A TIMESYNC answer arrived at `now_ns` of the station's clock."""
        replies = self._open.setdefault(ts1_ns, {})
        replies[sysid] = _Reply(tc1_ns, now_ns - ts1_ns)
        reference = replies.get(self._reference)
        if reference is not None:
            for other, r in replies.items():
                self._rounds[other].append(
                    (r.round_trip_ns + reference.round_trip_ns, r.boot_ns - reference.boot_ns)
                )
            self._open[ts1_ns] = {self._reference: reference}
        for old in sorted(self._open)[:-KEPT_ROUNDS]:
            del self._open[old]

    def fleet_time_s(self, sysid: int, boot_s: float) -> float:
        """A vehicle's own time as fleet time; as it is while nothing is known of its offset."""
        rounds = self._rounds[sysid]
        return boot_s - (min(rounds)[1] * 1e-9 if rounds else 0.0)
