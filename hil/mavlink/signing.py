"""MAVLink 2 signing: who has the key may speak, and nothing may be said twice.

A signature is 13 bytes: link id, time stamp, and the first 48 bits of
SHA-256(key, frame, link id, time stamp). Time stamps count 10 us since 2015-01-01 and rise within
each stream (system, component, link). Source: MAVLink's guide, "Message Signing".
"""

import hashlib
import hmac
from collections.abc import Callable

KEY_BYTES, SIGNATURE_BYTES = 32, 13
EPOCH_S = 1_420_070_400  # 2015-01-01 in Unix time
TICKS_PER_S = 100_000
NEW_STREAM_LAG = 60 * TICKS_PER_S  # a stream not heard before may be a minute late
MAX_STREAMS = 16
_LAST_TICK = 2**48 - 1


def ticks(unix_s: float) -> int:
    """A time as signatures count it."""
    return max(0, round((unix_s - EPOCH_S) * TICKS_PER_S))


def key_of(passphrase: str) -> bytes:
    """The key that common ground stations make of a pass phrase."""
    return hashlib.sha256(passphrase.encode()).digest()


Streams = dict[tuple[int, int, int], int]  # (system, component, link): its last time stamp


class Signing:
    """One link's memory of time stamps. `now` gives the time in ticks; it need not be right.

    Links of one machine share their `streams`: what was said on one is not said again on another.
    """

    def __init__(
        self, key: bytes, link_id: int, now: Callable[[], int], streams: Streams | None = None
    ) -> None:
        if len(key) != KEY_BYTES:
            raise ValueError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self._key, self._link_id, self._now = key, link_id, now
        self._latest = 0  # of all stamps sent and accepted
        self._streams: Streams = {} if streams is None else streams

    def sign(self, frame: bytes) -> bytes:
        """The frame, whose signed flag is set, with its signature."""
        self._latest = min(_LAST_TICK, max(self._now(), self._latest + 1))
        tail = bytes([self._link_id]) + self._latest.to_bytes(6, "little")
        return frame + tail + self._digest(frame + tail)

    def accepts(self, frame: bytes, sysid: int, compid: int) -> bool:
        """Whether a whole signed frame is genuine and new; it is remembered if so."""
        if not self.is_genuine(frame) or not self.is_new(frame, sysid, compid):
            return False
        stamp = _stamp(frame)
        self._streams[sysid, compid, frame[-13]] = stamp
        self._latest = max(self._latest, stamp)
        return True

    def is_genuine(self, frame: bytes) -> bool:
        """Whether who signed a whole frame has the key."""
        return hmac.compare_digest(self._digest(frame[:-6]), frame[-6:])

    def is_new(self, frame: bytes, sysid: int, compid: int) -> bool:
        """Whether a whole signed frame is later than all of its stream so far."""
        last = self._streams.get((sysid, compid, frame[-13]))
        if last is None:
            if len(self._streams) >= MAX_STREAMS:
                return False
            last = max(self._now(), self._latest) - NEW_STREAM_LAG
        return _stamp(frame) > last

    def _digest(self, signed: bytes) -> bytes:
        return hashlib.sha256(self._key + signed).digest()[:6]


def _stamp(frame: bytes) -> int:
    return int.from_bytes(frame[-12:-6], "little")
