"""A MAVLink port: one peer of the vehicle, with its own streams, sequence and outbox.

Answers go to who asked. Stations share services, but never with the injector.
"""

from collections import Counter
from collections.abc import Callable, Iterable

from hil.mavlink import (
    COMPONENT_AUTOPILOT,
    Decoder,
    Encoder,
    Message,
    Refusal,
    Severity,
    Signing,
    StatusText,
)
from sim_vehicles.services.service import Handlers, Request
from sim_vehicles.services.streams import StreamService

COMPLAINT_S = 5.0
WHY: dict[Refusal, str] = {
    "unsigned": "not signed",
    "forged": "signature does not match",  # a text has room for 50 characters
    "replayed": "signed before",
}


class Port:
    """Hands what arrives to the service for it, and queues what is to be sent."""

    def __init__(
        self,
        sysid: int,
        handlers: Handlers,
        streams: StreamService,
        signing: Signing | None = None,
        unsigned_too: Callable[[], bool] = lambda: False,
    ) -> None:
        self._sysid, self._handlers, self._streams = sysid, handlers, streams
        self._decoder = Decoder(signing, unsigned_too)
        self._encoder = Encoder(sysid, COMPONENT_AUTOPILOT, signing)
        self._outbox: list[bytes] = []
        self._complained: Counter[Refusal] = Counter()
        self._complained_s = -COMPLAINT_S

    def receive(self, datagram: bytes, now_s: float) -> None:
        """Handle all frames of a datagram that are meant for this vehicle."""
        heard = self._decoder.decode(datagram)
        self._complain(now_s)
        for received in heard:
            value = received.value
            if not isinstance(value, Message) or not self._is_for_us(value):
                continue
            handler = self._handlers.get(type(value))
            if handler is not None:
                self.send(handler(Request(now_s, received.sysid, received.compid, value)))

    def step(self, now_s: float) -> None:
        """Queue the streams that are due."""
        messages = self._streams.step(now_s)
        if messages:
            self.send(messages)

    def send(self, messages: Iterable[Message]) -> None:
        self._outbox.extend(map(self._encoder.encode, messages))

    def drain(self) -> list[bytes]:
        """All that is to be sent, oldest first."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def _complain(self, now_s: float) -> None:
        """Say what signing has refused, at once and then each COMPLAINT_S while there is more."""
        refused = self._decoder.refused
        if refused == self._complained or now_s - self._complained_s < COMPLAINT_S:
            return
        texts = [f"{n} frames refused: {WHY[why]}" for why, n in refused.items()]
        self._complained, self._complained_s = refused.copy(), now_s
        self.send(StatusText(Severity.WARNING, text) for text in texts)

    def _is_for_us(self, value: Message) -> bool:
        return getattr(value, "target_sysid", 0) in (0, self._sysid) and getattr(
            value, "target_compid", 0
        ) in (0, COMPONENT_AUTOPILOT)
