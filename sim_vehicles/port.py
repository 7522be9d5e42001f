"""A MAVLink port: one peer of the vehicle, with its own streams, sequence and outbox.

Answers go to who asked. Stations share services, but never with the injector.
"""

from collections.abc import Iterable

from hil.mavlink import COMPONENT_AUTOPILOT, Decoder, Encoder, Message, Signing
from sim_vehicles.services.service import Handlers, Request
from sim_vehicles.services.streams import StreamService


class Port:
    """Hands what arrives to the service for it, and queues what is to be sent."""

    def __init__(
        self,
        sysid: int,
        handlers: Handlers,
        streams: StreamService,
        signing: Signing | None = None,
    ) -> None:
        self._sysid, self._handlers, self._streams = sysid, handlers, streams
        self._decoder = Decoder(signing)
        self._encoder = Encoder(sysid, COMPONENT_AUTOPILOT, signing)
        self._outbox: list[bytes] = []

    def receive(self, datagram: bytes, now_s: float) -> None:
        """Handle all frames of a datagram that are meant for this vehicle."""
        for received in self._decoder.decode(datagram):
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

    def _is_for_us(self, value: Message) -> bool:
        return getattr(value, "target_sysid", 0) in (0, self._sysid) and getattr(
            value, "target_compid", 0
        ) in (0, COMPONENT_AUTOPILOT)
