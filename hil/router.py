"""Several vehicles behind one connection: frames are sorted by who sent them."""

import time
from collections.abc import Callable

from hil.carriers import Carrier
from hil.link import PEER_FORGOTTEN_S, Address
from hil.mavlink import MessageId
from hil.mavlink.stream import message_id

TO_ALL = (MessageId.HEARTBEAT, MessageId.TIMESYNC)  # messages without an addressee
INBOX_FRAMES = 1000  # of a vehicle that nobody reads; the oldest go first


class Router:
    """Ends by system id. Frames of vehicles that have no end are dropped.

    A vehicle speaks from the address where it was first heard. While it does, nobody takes its
    place: what comes in its name from elsewhere is dropped. `now` is a monotonic clock in seconds.
    """

    def __init__(self, carrier: Carrier, now: Callable[[], float] = time.monotonic) -> None:
        self._carrier, self._now = carrier, now
        self._inboxes: dict[int, list[bytes]] = {}
        self._peers: dict[int, Address | None] = {}
        self._heard_s: dict[int, float] = {}
        self._is_welcome: dict[int, Callable[[bytes], bool]] = {}
        self._hear_of: Callable[[int], None] = lambda _sysid: None

    def end(self, sysid: int) -> "RouterEnd":
        self._inboxes[sysid] = []
        return RouterEnd(self, sysid)

    def guard(
        self, sysid: int, is_welcome: Callable[[bytes], bool], hear_of: Callable[[int], None]
    ) -> None:
        """Ask whether a frame from a new address is a vehicle's; tell who else there is."""
        self._is_welcome[sysid], self._hear_of = is_welcome, hear_of

    def fileno(self) -> int:
        """For `select`."""
        return self._carrier.fileno()

    def take(self, sysid: int) -> list[bytes]:
        """What one vehicle has sent, a frame each, oldest first."""
        for peer, (sender, frame) in self._carrier.receive():
            inbox = self._inboxes.get(sender)
            if inbox is None:
                self._hear_of(sender)
            elif self._is_from(sender, peer, frame):
                self._heard_s[sender] = self._now()
                inbox.append(frame)
                del inbox[:-INBOX_FRAMES]
        taken, self._inboxes[sysid] = self._inboxes[sysid], []
        return taken

    def _is_from(self, sysid: int, peer: Address | None, frame: bytes) -> bool:
        known = sysid in self._peers
        if known and self._peers[sysid] == peer:
            return True
        if sysid in self._is_welcome and not self._is_welcome[sysid](frame):
            return False
        if known and self._now() - self._heard_s[sysid] <= PEER_FORGOTTEN_S:
            return False
        self._peers[sysid] = peer
        return True

    def send(self, sysid: int, frame: bytes) -> None:
        """To one vehicle; a frame without an addressee goes to all behind this connection."""
        if message_id(frame) in TO_ALL and self._peers:
            for peer in dict.fromkeys(self._peers.values()):
                self._carrier.send(frame, peer)
        else:
            self._carrier.send(frame, self._peers.get(sysid))

    def close(self) -> None:
        self._carrier.close()


class RouterEnd:
    """The link to one vehicle."""

    def __init__(self, router: Router, sysid: int) -> None:
        self.router, self.sysid = router, sysid

    def send(self, datagram: bytes) -> None:
        self.router.send(self.sysid, datagram)

    def receive(self) -> list[bytes]:
        return self.router.take(self.sysid)

    def guard(self, is_welcome: Callable[[bytes], bool], hear_of: Callable[[int], None]) -> None:
        """As `Router.guard`, for this vehicle."""
        self.router.guard(self.sysid, is_welcome, hear_of)

    def fileno(self) -> int:
        return self.router.fileno()
