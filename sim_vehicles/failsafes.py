"""Failsafes: what trips, and the mode to go to then (pure)."""

from dataclasses import dataclass, replace
from typing import Self

from hil.mavlink import FenceStatus, RoverMode
from sim_vehicles.autopilot import Failsafe
from sim_vehicles.parameters import Parameters

_FENCE_ACTIONS = {0: None, 1: RoverMode.RTL, 2: RoverMode.HOLD}


@dataclass(frozen=True, slots=True)
class Signs:
    """What the failsafes look at. `gcs_silence_s` is None while there is nothing to miss."""

    gcs_silence_s: float | None
    outside: bool
    mode: RoverMode


@dataclass(frozen=True, slots=True)
class Trip:
    """Whether a failsafe is tripped now, and the mode it asks for when it trips."""

    which: Failsafe
    tripped: bool
    action: RoverMode | None = RoverMode.HOLD


def trips(signs: Signs, parameters: Parameters) -> tuple[Trip, ...]:
    """All failsafes, the weakest first: what acts last has the last word."""
    silence_s = signs.gcs_silence_s if parameters["FS_GCS_ENABLE"] else None
    gcs_lost = silence_s is not None and silence_s > parameters["FS_TIMEOUT"]
    return (
        Trip(Failsafe.FENCE, signs.outside, _FENCE_ACTIONS[int(parameters["FENCE_ACTION"])]),
        Trip(Failsafe.GCS, gcs_lost),
    )


@dataclass(frozen=True, slots=True)
class Breaches:
    """The record of the fence."""

    outside: bool = False
    count: int = 0
    last_s: float = 0.0

    def at(self, now_s: float, outside: bool) -> Self:
        if outside == self.outside:
            return self
        if not outside:
            return replace(self, outside=False)
        return replace(self, outside=True, count=self.count + 1, last_s=now_s)

    def status(self) -> FenceStatus:
        return FenceStatus(self.outside, self.count, self.last_s)
