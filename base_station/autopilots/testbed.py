"""The autopilot of our own vehicles (`sim-vehicle`): goes any way its airframe can, at once."""

from typing import ClassVar

from base_station.autopilots.adapter import Autopilot, Rate
from base_station.receiving.telemetry import Status
from hil.mavlink import RoverMode


class Testbed(Autopilot):
    """Streams unasked, shares the fleet's origin, listens to `links.station_sysid` from the start.

    Its modes are ArduPilot Rover's for every airframe.
    """

    NAME: ClassVar[str] = "testbed"
    has_own_origin: ClassVar[bool] = False
    response: ClassVar[str] = "integrating"
    estimate_lags: ClassVar[bool] = True

    @property
    def driven_mode(self) -> int:
        return int(RoverMode.GUIDED)

    @property
    def hold_mode(self) -> int:
        return int(RoverMode.HOLD)

    def ready(self, status: Status) -> bool:
        return status.prearm_ok

    def rates(self, telemetry_hz: float) -> tuple[Rate, ...]:
        del telemetry_hz
        return ()
