"""`--dry-run`: what would be sent is shown, and nothing is sent."""

from collections.abc import Callable

from hil.mavlink import Decoder
from hil.router import RouterEnd


class DryEnd(RouterEnd):
    """Hears as the end it stands for; `show` gets each command in words."""

    def __init__(self, end: RouterEnd, name: str, show: Callable[[str], None]) -> None:
        super().__init__(end.router, end.sysid)
        self._name, self._show, self._decoder = name, show, Decoder()

    def send(self, datagram: bytes) -> None:
        for message in self._decoder.decode(datagram):
            self._show(f"{self._name} <- {message.value}")
