"""What differs between autopilots: one small file each, and nothing else knows their names."""

from base_station.autopilots.adapter import Autopilot, Rate, Setting
from base_station.autopilots.ardupilot import ArduPilot
from base_station.autopilots.heading import HeadingFirst
from base_station.autopilots.px4 import Px4
from base_station.autopilots.testbed import Testbed
from hil.airframe import Airframe
from hil.errors import InputError

_KNOWN: tuple[type[Autopilot], ...] = (Testbed, ArduPilot, Px4)
NAMES = tuple(kind.NAME for kind in _KNOWN)

__all__ = ["NAMES", "Autopilot", "HeadingFirst", "Rate", "Setting", "adapter"]


def adapter(name: str, frame: Airframe) -> Autopilot:
    """The adapter for an autopilot in an airframe. Raises InputError for a name unknown here."""
    for kind in _KNOWN:
        if name == kind.NAME:
            return kind(frame)
    raise InputError(
        f"autopilot = {name!r}: the base station has no adapter for that; "
        f"it knows {', '.join(NAMES)}"
    )
