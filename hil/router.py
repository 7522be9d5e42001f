"""Several vehicles behind one connection: frames are sorted by who sent them."""

from hil.carriers import Carrier
from hil.link import Address
from hil.mavlink import MessageId
from hil.mavlink.stream import message_id

TO_ALL = (MessageId.HEARTBEAT, MessageId.TIMESYNC)  # messages without an addressee
INBOX_FRAMES = 1000  # of a vehicle that nobody reads; the oldest go first


class Router:
    """Ends by system id. Frames of vehicles that have no end are dropped."""

    def __init__(self, carrier: Carrier) -> None:
        self._carrier = carrier
        self._inboxes: dict[int, list[bytes]] = {}
        self._peers: dict[int, Address | None] = {}

    def end(self, sysid: int) -> "RouterEnd":
        self._inboxes[sysid] = []
        return RouterEnd(self, sysid)

    def fileno(self) -> int:
        """For `select`."""
        return self._carrier.fileno()

    def take(self, sysid: int) -> list[bytes]:
        """What one vehicle has sent, a frame each, oldest first."""
        for peer, (sender, frame) in self._carrier.receive():
            inbox = self._inboxes.get(sender)
            if inbox is not None:
                self._peers[sender] = peer
                inbox.append(frame)
                del inbox[:-INBOX_FRAMES]
        taken, self._inboxes[sysid] = self._inboxes[sysid], []
        return taken

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
        self._router, self._sysid = router, sysid

    def send(self, datagram: bytes) -> None:
        self._router.send(self._sysid, datagram)

    def receive(self) -> list[bytes]:
        return self._router.take(self._sysid)

    def fileno(self) -> int:
        return self._router.fileno()
