"""One identification: a station that excites instead of deciding, a listener, and the fits."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from base_station.autopilots import Rate, adapter
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.identify.excitation import Excitation
from base_station.identify.fit import AxisFit, fit_axis
from base_station.identify.noise import NoiseFit, RestNoise
from base_station.identify.responses import response_of
from base_station.planning.requests import PlanProgress, PlanReady
from base_station.receiving.telemetry import Frame
from base_station.records import Event, Snapshot
from base_station.station import Station
from hil.frames import wgs84_to_ned
from hil.mavlink import COMPONENT_AUTOPILOT, Decoder, GpsRaw, MessageId
from hil.scenario import StationView

AXES = ("x", "y")
GPS_HZ = 10.0


@dataclass(frozen=True)
class VehicleFit:
    """What was found of one vehicle; an axis that it can't drive along is not there."""

    sysid: int
    axes: Mapping[str, AxisFit]
    noise: NoiseFit | None


class Identification:
    """`station` goes into a node that has this as a listener; `fits` when it has finished."""

    def __init__(self, view: StationView) -> None:
        self._view = view
        self._excitation = Excitation(view)
        self.station = Station(view, self._decide, wants=(Rate(MessageId.GPS_RAW_INT, GPS_HZ),))
        self._decoder = Decoder()
        self._noises = [RestNoise(view.origin.origin()) for _ in view.fleet]
        self._fixes: list[list[tuple[float, ...]]] = [[] for _ in view.fleet]
        self._at_rest = [True] * len(view.fleet)

    @property
    def duration_s(self) -> float:
        return self._excitation.duration_s

    @property
    def complete(self) -> bool:
        """Whether it came to its end, and was not stopped."""
        return self.station.desk.phase.name == "done"

    def _decide(self, desk: Desk, frame: Frame) -> Orders:
        orders = self._excitation.decide(desk, frame)
        resting = self._excitation.resting(frame.time_s)
        self._at_rest = [i in resting for i in range(len(self._view.fleet))]
        return orders

    def fits(self) -> tuple[VehicleFit, ...]:
        """Raises ValueError naming the vehicle that gave too little."""
        axes: list[dict[str, AxisFit]] = [{} for _ in self._view.fleet]
        for tried in self._excitation.tried():
            member = self._view.fleet[tried.index]
            autopilot = adapter(member.autopilot, member.frame)
            if autopilot.estimate_lags:
                tried = tried.seen_as(np.array(self._fixes[tried.index]))
            axis = AXES[tried.axis]
            try:
                axes[tried.index][axis] = fit_axis(
                    tried, response_of(autopilot, member.frame, axis)
                )
            except ValueError as error:
                raise ValueError(f"{member.name}, body {axis}: {error}") from None
        return tuple(
            VehicleFit(m.sysid, axes[i], self._noises[i].fit())
            for i, m in enumerate(self._view.fleet)
        )

    def datagram(self, index: int, _time_us: int, datagram: bytes) -> None:
        """Of a node: the fixes of vehicles that stand."""
        for message in self._decoder.decode(datagram):
            if message.compid != COMPONENT_AUTOPILOT or not isinstance(message.value, GpsRaw):
                continue
            if message.sysid != self._view.fleet[index].sysid:
                continue
            self._note(index, message.value)
            if self._at_rest[index]:
                self._noises[index].take(message.value)
            else:
                self._noises[index].pause()

    def _note(self, index: int, fix: GpsRaw) -> None:
        time_s = self.station.desk.fleet.fleet_time_s(index, fix.time_s)
        if self._fixes[index] and time_s <= self._fixes[index][-1][0]:
            return
        place = wgs84_to_ned(fix.lat_deg, fix.lon_deg, self._view.origin.origin())
        speed, course = fix.speed_mps, fix.course_rad
        velocity = (speed * math.cos(course), speed * math.sin(course))
        self._fixes[index].append((time_s, *place, *velocity))

    def snapshot(self, snapshot: Snapshot) -> None: ...

    def event(self, event: Event) -> None: ...

    def progress(self, progress: PlanProgress) -> None: ...

    def plan(self, answer: PlanReady) -> None: ...

    def result(self, outcome: Mapping[str, Any]) -> None: ...
