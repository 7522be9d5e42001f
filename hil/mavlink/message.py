"""What every typed message is, and the small conversions they share.

A message class holds SI units (m, m/s, rad, s; NED). `from_wire` takes the fields in wire order
(pymavlink's `ordered_fieldnames`, arrays spread out) and returns None for a value that is no
value: NaN or infinite where a number is needed. `to_wire` is the way back.
"""

import math
from typing import Any, ClassVar, Self

from hil.mavlink.enums import MessageId

Vector = tuple[float, float, float]


class Message:
    """Base of all typed messages; `ID` is the MAVLink message it stands for."""

    ID: ClassVar[MessageId]
    __slots__ = ()

    @classmethod
    def from_wire(cls, *args: Any, **kwargs: Any) -> Self | None:
        raise NotImplementedError

    def to_wire(self) -> tuple[Any, ...]:
        raise NotImplementedError


def finite(*values: float) -> bool:
    """Whether all are numbers; float32 values can't overflow their sum."""
    return math.isfinite(sum(values))


def clip(value: float, low: int, high: int) -> int:
    """Round into the range of an integer field."""
    return max(low, min(high, round(value)))


def int16(value: float) -> int:
    return clip(value, -32768, 32767)


def int32(value: float) -> int:
    return clip(value, -(2**31), 2**31 - 1)


def uint16(value: float) -> int:
    return clip(value, 0, 65535)


def milliseconds(time_s: float) -> int:
    """A time_boot_ms field; it wraps after 49 days, as in a real autopilot."""
    return round(time_s * 1e3) % 2**32


def heading_cdeg(yaw_rad: float) -> int:
    """A heading field in 0..35999 centidegrees."""
    return round(math.degrees(yaw_rad) * 100) % 36000


def text_to_wire(text: str) -> bytes:
    return text.encode("ascii", "replace")


def text_from_wire(raw: bytes) -> str:
    return raw.split(b"\0", 1)[0].decode("ascii", "replace")
