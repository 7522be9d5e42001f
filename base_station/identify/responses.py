"""Models of how speed along one body axis follows its set-point (pure).

Times are vehicle time; a set-point holds from when it was sent plus the latency.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.autopilots import Autopilot, HeadingFirst
from hil.airframe import Airframe

Array = NDArray[np.float64]

INTEGRATOR_GAIN, INTEGRATOR_LIMIT = 0.5, 0.1  # of the velocity loop of our own autopilot
STANDSTILL_MPS = 0.02
DT_S = 0.01


@dataclass(frozen=True)
class Derived:
    """What a person, and the twin, want to know of a fit."""

    time_constant_s: float
    speed_gain: float  # steady speed over set-point, integrator aside
    latency_s: float


class Response(ABC):
    """Parameters are a vector; the last one is the latency (s), which the simulation leaves out."""

    name: str
    start: Array
    low: Array
    high: Array
    steps: Array  # of the numerical slopes

    @abstractmethod
    def speeds(self, p: Array, setpoint_mps: Array) -> Array:
        """[K] speed after each of K steps of DT_S from rest; NaN is HOLD."""

    @abstractmethod
    def derived(self, p: Array, speed_mps: float) -> Derived:
        """At a set-point of `speed_mps`."""


class FirstOrder(Response):
    """v' = (gain u - v) / tau: any velocity controller, seen from afar. p = gain, tau, latency."""

    name = "first_order"

    def __init__(self) -> None:
        self.start = np.array([1.0, 0.4, 0.1])
        self.low = np.array([0.2, 0.02, 0.0])
        self.high = np.array([3.0, 5.0, 1.5])
        self.steps = np.array([0.01, 0.01, 0.01])

    def speeds(self, p: Array, setpoint_mps: Array) -> Array:
        gain, tau_s, _ = (float(x) for x in p)
        keep = math.exp(-DT_S / tau_s)
        v, out = 0.0, np.empty(len(setpoint_mps))
        for k, setpoint in enumerate(np.nan_to_num(setpoint_mps).tolist()):
            v = keep * v + (1.0 - keep) * gain * setpoint
            out[k] = v
        return out

    def derived(self, p: Array, speed_mps: float) -> Derived:
        del speed_mps
        return Derived(float(p[1]), float(p[0]), float(p[2]))


class Integrating(Response):
    """Our own autopilot on DC motors: feed-forward, bounded integrator, rolling resistance.

    p = stall acceleration (m/s2), rolling deceleration (m/s2), lag of the speed estimate that the
    integrator reads (s), latency (s). The twin's kernel has the same equations without that lag;
    left out here it would bias the rest by a tenth.
    """

    name = "integrating"

    def __init__(self, frame: Airframe, axis: str) -> None:
        motors = [frame.motors[i - 1] for i in frame.axis_motors(axis)]
        self._free_mps = sum(m.free_speed_mps for m in motors) / len(motors)
        stall_n = frame.axis_stall_force_n(axis)
        self._rolling_share = frame.rolling_force_n / stall_n
        stall, rolling = stall_n / frame.mass_kg, frame.rolling_force_n / frame.mass_kg
        self.start = np.array([stall, rolling, 0.05, 0.1])
        self.low = np.array([0.3 * stall, 0.0, 0.006, 0.0])
        self.high = np.array([3.0 * stall, 5.0 * rolling, 0.3, 1.5])
        self.steps = np.array([0.02 * stall, 0.02 * rolling, 0.005, 0.01])

    def speeds(self, p: Array, setpoint_mps: Array) -> Array:
        stall, rolling, lag_s, _ = (float(x) for x in p)
        forget = math.exp(-DT_S / lag_s)
        half = 0.5 * stall * DT_S / self._free_mps
        v = seen = i = 0.0
        out = np.empty(len(setpoint_mps))
        for k, sp in enumerate(setpoint_mps.tolist()):
            if sp == sp:
                i += INTEGRATOR_GAIN * DT_S * (sp - seen)
                i = max(-INTEGRATOR_LIMIT, min(INTEGRATOR_LIMIT, i))
                rolls = math.copysign(self._rolling_share, sp) if abs(sp) >= STANDSTILL_MPS else 0.0
                u = max(-1.0, min(1.0, sp / self._free_mps + rolls + i))
                v = (v * (1.0 - half) + stall * u * DT_S) / (1.0 + half)  # trapezoidal
            else:
                i = 0.0
            v = math.copysign(max(0.0, abs(v) - rolling * DT_S), v)
            seen = forget * seen + (1.0 - forget) * v
            out[k] = v
        return out

    def derived(self, p: Array, speed_mps: float) -> Derived:
        stall, rolling, latency_s = float(p[0]), float(p[1]), float(p[-1])
        lost = self._free_mps * (self._rolling_share - rolling / stall)
        return Derived(self._free_mps / stall, 1.0 + lost / speed_mps, latency_s)


class NoseFirst(Response):
    """A heading-first autopilot, sent along its own nose, on DC motors: as the twin has it.

    p = stall acceleration (m/s2), slew of the throttle (1/s), latency (s); its gains are known.
    """

    name = "heading_first"

    def __init__(self, frame: Airframe, helm: HeadingFirst) -> None:
        motors = [frame.motors[i - 1] for i in frame.axis_motors("x")]
        self._free_mps = sum(m.free_speed_mps for m in motors) / len(motors)
        self._rolling = frame.rolling_force_n / frame.mass_kg
        self._helm = helm
        stall = frame.axis_stall_force_n("x") / frame.mass_kg
        self.start = np.array([stall, helm.slew_per_s, 0.1])
        self.low = np.array([0.3 * stall, 0.1, 0.0])
        self.high = np.array([3.0 * stall, 20.0, 1.5])
        self.steps = np.array([0.02 * stall, 0.02, 0.01])

    def speeds(self, p: Array, setpoint_mps: Array) -> Array:
        stall, slew, _ = (float(x) for x in p)
        helm, v, ahead, i, throttle = self._helm, 0.0, 0.0, 0.0, 0.0
        out = np.empty(len(setpoint_mps))
        for k, setpoint in enumerate(setpoint_mps.tolist()):
            on = setpoint == setpoint
            change = (setpoint if on else 0.0) - ahead
            ahead = ahead + _clip(change, helm.accel_mps2 * DT_S) if on else 0.0
            moving = on and not (ahead == 0.0 and abs(v) < helm.stop_mps)
            error = ahead - v
            wanted = helm.speed_ff * ahead + helm.speed_p * error
            slews = abs(_clip(wanted + i, 1.0) - throttle) > slew * DT_S
            if not slews or error * i < 0.0:  # else the integral waits for the throttle
                i = _clip(i + helm.speed_i * DT_S * error, 1.0)
            i = i if moving else 0.0
            wanted = wanted + i if moving else 0.0
            throttle += _clip(_clip(wanted, 1.0) - throttle, slew * DT_S)
            v += DT_S * stall * (throttle - v / self._free_mps)
            v = math.copysign(max(0.0, abs(v) - self._rolling * DT_S), v)
            out[k] = v
        return out

    def derived(self, p: Array, speed_mps: float) -> Derived:
        del speed_mps
        quick = float(p[0]) * (1.0 / self._free_mps + self._helm.speed_p)
        return Derived(1.0 / quick, 1.0, float(p[-1]))


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def response_of(autopilot: Autopilot, frame: Airframe, axis: str) -> Response:
    """The model that an adapter names for its autopilot."""
    name = autopilot.response
    if autopilot.helm is not None:
        return NoseFirst(frame, autopilot.helm)
    return Integrating(frame, axis) if name == Integrating.name else FirstOrder()


def on_grid(sent_s: Array, setpoint_mps: Array) -> tuple[Array, Array]:
    """Times from the first row on in steps of DT_S, and the set-point sent by then."""
    since_s = sent_s - sent_s[0]
    grid_s = np.linspace(0.0, since_s[-1], round(since_s[-1] / DT_S) + 1)
    return grid_s, setpoint_mps[np.searchsorted(since_s, grid_s + 1e-6, side="right") - 1]
