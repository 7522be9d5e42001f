"""Failsafes: what trips, and the mode to go to then (pure)."""

from dataclasses import dataclass, replace
from typing import Self

from hil.mavlink import FenceStatus, RoverMode
from sim_vehicles.autopilot import Failsafe
from sim_vehicles.parameters import Parameters

GPS_LOST_AFTER_S = 5.0  # without a fix; the estimate has drifted by then
_ACTIONS = {0: None, 1: RoverMode.RTL, 2: RoverMode.HOLD}
_EKF_ACTIONS = {1: RoverMode.HOLD, 2: None}


@dataclass(frozen=True, slots=True)
class Sagging:
    """Since when (s) the voltage has been low, and critical; None when it is not."""

    low_s: float | None = None
    critical_s: float | None = None

    def at(self, now_s: float, voltage_v: float, parameters: Parameters) -> Self:
        low = voltage_v < parameters["BATT_LOW_VOLT"]
        critical = voltage_v < parameters["BATT_CRT_VOLT"]
        if not (low or critical or self.low_s is not None or self.critical_s is not None):
            return self
        return replace(
            self,
            low_s=(self.low_s if self.low_s is not None else now_s) if low else None,
            critical_s=(self.critical_s if self.critical_s is not None else now_s)
            if critical
            else None,
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


@dataclass(frozen=True, slots=True)
class Signs:
    """What the failsafes look at. Ages are None while there is nothing to miss."""

    now_s: float
    mode: RoverMode
    gcs_silence_s: float | None
    fix_age_s: float | None
    sagging: Sagging
    outside: bool

    @property
    def gps_lost(self) -> bool:
        return self.fix_age_s is not None and self.fix_age_s > GPS_LOST_AFTER_S


@dataclass(frozen=True, slots=True)
class Trip:
    """Whether a failsafe is tripped now, and the mode it asks for when it trips."""

    which: Failsafe
    tripped: bool
    action: RoverMode | None = RoverMode.HOLD


def trips(signs: Signs, parameters: Parameters) -> tuple[Trip, ...]:
    """All failsafes, the weakest first: what acts last has the last word."""
    timer_s = parameters["BATT_LOW_TIMER"]

    def is_over(since_s: float | None) -> bool:
        return since_s is not None and signs.now_s - since_s > timer_s

    def action(name: str) -> RoverMode | None:
        """Without a position there is no way home."""
        wanted = _ACTIONS[int(parameters[name])]
        return RoverMode.HOLD if wanted is RoverMode.RTL and signs.gps_lost else wanted

    silence_s = signs.gcs_silence_s if parameters["FS_GCS_ENABLE"] else None
    gcs_lost = silence_s is not None and silence_s > parameters["FS_TIMEOUT"]
    ekf_action = _EKF_ACTIONS[int(parameters["FS_EKF_ACTION"])]
    return (
        Trip(Failsafe.FENCE, signs.outside, action("FENCE_ACTION")),
        Trip(Failsafe.BATTERY_LOW, is_over(signs.sagging.low_s), action("BATT_FS_LOW_ACT")),
        Trip(Failsafe.GCS, gcs_lost),
        Trip(Failsafe.GPS, signs.gps_lost, None if signs.mode is RoverMode.MANUAL else ekf_action),
        Trip(
            Failsafe.BATTERY_CRITICAL, is_over(signs.sagging.critical_s), action("BATT_FS_CRT_ACT")
        ),
    )


def complaints(signs: Signs, parameters: Parameters) -> tuple[str, ...]:
    """What speaks against arming."""
    told = []
    if signs.outside:
        told.append("vehicle outside fence")
    if signs.sagging.low_s is not None or signs.sagging.critical_s is not None:
        told.append(f"battery below {parameters['BATT_LOW_VOLT']:.1f} V")
    return tuple(told)
