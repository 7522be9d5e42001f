"""Connection strings in the form that MAVLink tools share: where a vehicle can be spoken to (pure).

`udpin:HOST:PORT` waits for whoever speaks first, `udpout:HOST:PORT` speaks first, `tcp:HOST:PORT`
connects, `serial:DEVICE,BAUD` is a radio or a cable.
"""

from dataclasses import dataclass
from ipaddress import ip_address
from typing import Literal

Kind = Literal["udpin", "udpout", "tcp", "serial"]
BAUDS = (9_600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800, 500_000, 921_600, 1_500_000)
FORMS = "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE,BAUD"


@dataclass(frozen=True)
class Connection:
    """`host` and `port`, or for 'serial' the device in `host` and the baud rate in `port`."""

    kind: Kind
    host: str
    port: int

    @property
    def is_on_this_machine(self) -> bool:
        """A simulator's: nothing that can hurt anybody is at the other end."""
        if self.kind == "serial":
            return False
        try:
            return self.host == "localhost" or ip_address(self.host).is_loopback
        except ValueError:
            return False

    @property
    def bytes_per_s(self) -> float | None:
        """What a serial line carries with 8N1; None for what is fast enough."""
        return self.port / 10.0 if self.kind == "serial" else None

    def __str__(self) -> str:
        return f"{self.kind}:{self.host}{',' if self.kind == 'serial' else ':'}{self.port}"


def parse_connection(text: str) -> Connection:
    """Raises ValueError with what is wrong and the forms there are."""
    kind, colon, rest = text.partition(":")
    match kind:
        case "udpin" | "udpout" | "tcp" if colon:
            host, _, port = rest.rpartition(":")
            return Connection(kind, _named(host), _number(port, "port", 1, 65_535))
        case "serial" if colon:
            device, _, baud = rest.rpartition(",")
            number = _number(baud, "baud rate", BAUDS[0], BAUDS[-1])
            if number not in BAUDS:
                raise ValueError(f"baud rate {number} is none of {', '.join(map(str, BAUDS))}")
            return Connection("serial", _named(device), number)
        case _:
            raise ValueError(f"must be {FORMS}")


def _named(text: str) -> str:
    if not text or any(c.isspace() for c in text):
        raise ValueError(f"names no host or device; must be {FORMS}")
    return text


def _number(text: str, what: str, low: int, high: int) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) <= 8 and low <= int(text) <= high):
        raise ValueError(f"{what} {text!r} must be {low} to {high}; the forms are {FORMS}")
    return int(text)
