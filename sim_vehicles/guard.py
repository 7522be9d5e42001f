"""What failsafes remember and look at: fence, voltage, silence of the station, age of the fix."""

from collections.abc import Mapping

from hil.mavlink import FenceStatus, Heartbeat, Message, RoverMode
from sim_vehicles.autopilot import Readiness
from sim_vehicles.failsafes import Breaches, Sagging, Signs, Trip, complaints, trips
from sim_vehicles.navigator import Navigator
from sim_vehicles.parameters import Parameters
from sim_vehicles.senses import Senses
from sim_vehicles.services.service import Handler, Replies, Request


class Guard:
    """Watches, and says what has tripped; what to do about it is the helm's."""

    def __init__(self, parameters: Parameters, navigator: Navigator, senses: Senses) -> None:
        self._parameters, self._navigator, self._senses = parameters, navigator, senses
        self._breaches, self._sagging = Breaches(), Sagging()
        self._gcs_heard_s: float | None = None
        self._now_s = 0.0

    def handlers(self) -> Mapping[type[Message], Handler]:
        return {Heartbeat: self._heard}

    def watch(self, now_s: float, voltage_v: float, mode: RoverMode) -> tuple[Trip, ...]:
        """All failsafes as they are now."""
        self._now_s = now_s
        self._breaches = self._breaches.at(now_s, self._is_outside())
        self._sagging = self._sagging.at(now_s, voltage_v, self._parameters)
        return trips(self._signs(mode), self._parameters)

    def readiness(self, mode: RoverMode) -> Readiness:
        signs = self._signs(mode)
        placed = self._senses.ready and not signs.gps_lost
        told = complaints(signs, self._parameters)
        return Readiness(placed, self._navigator.has_mission, told)

    def fence(self) -> FenceStatus | None:
        """None while it is switched off."""
        return self._breaches.status() if self._parameters["FENCE_ENABLE"] else None

    def _signs(self, mode: RoverMode) -> Signs:
        heard_s = self._gcs_heard_s
        return Signs(
            now_s=self._now_s,
            mode=mode,
            gcs_silence_s=None if heard_s is None else self._now_s - heard_s,
            fix_age_s=self._senses.fix_age_s,
            sagging=self._sagging,
            outside=self._breaches.outside,
        )

    def _is_outside(self) -> bool:
        home_m = self._senses.home_m
        if home_m is None or not self._parameters["FENCE_ENABLE"]:
            return False
        here_m = self._senses.estimate().position_m
        kinds, radius_m = int(self._parameters["FENCE_TYPE"]), self._parameters["FENCE_RADIUS"]
        return self._navigator.is_outside(here_m[:2], home_m[:2], kinds, radius_m)

    def _heard(self, request: Request) -> Replies:
        if request.sysid == self._parameters["SYSID_MYGCS"]:
            self._gcs_heard_s = request.now_s
        return []
