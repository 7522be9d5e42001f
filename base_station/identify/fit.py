"""Least squares of a response model on what a vehicle did (pure)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from base_station.identify.excitation import Tried
from base_station.identify.responses import Derived, Response, on_grid

Array = NDArray[np.float64]

VELOCITY_SIGMA_MPS, POSITION_SIGMA_M = 0.05, 0.02  # weights of the two kinds of report
LATENCIES_S = np.arange(0.0, 1.21, 0.05)  # where the search may start: latency has local minima
STARTS = 3
SLOW_S = 5.0  # a position error slower than this is the receiver's wander


@dataclass(frozen=True)
class AxisFit:
    """The best parameters, and what they leave unexplained (root mean square)."""

    model: str
    parameters: tuple[float, ...]
    derived: Derived
    residual_mps: float
    residual_m: float
    nominal_residual_m: float  # of the data sheet's parameters, latency 0
    link_s: float  # of the latency, what was the link's


def fit_axis(tried: Tried, response: Response) -> AxisFit:
    """Fit to velocity and position. Raises ValueError when there is too little to fit."""
    if len(tried.seen_s) < 30:
        raise ValueError(f"{len(tried.seen_s)} reports are too few for a fit; 30 are needed")

    def errors(p: Array) -> tuple[Array, Array]:
        return _errors(p, tried, response)

    def weighted(p: Array) -> Array:
        velocity, position = errors(p)
        return np.concatenate((velocity / VELOCITY_SIGMA_MPS, position / POSITION_SIGMA_M))

    steps = response.steps

    def slopes(p: Array) -> Array:
        columns = [(weighted(p + h) - weighted(p - h)) / (2.0 * h.sum()) for h in np.diag(steps)]
        return np.stack(columns, axis=1)

    starts = [np.append(response.start[:-1], latency_s) for latency_s in LATENCIES_S]
    starts.sort(key=lambda p: float(np.sum(weighted(p) ** 2)))
    found = [
        least_squares(
            weighted,
            np.clip(start, response.low + 1e-6, response.high - 1e-6),
            jac=slopes,
            bounds=(response.low, response.high),
            x_scale=response.steps,
        )
        for start in starts[:STARTS]
    ]
    best = min(found, key=lambda f: float(f.cost))
    velocity, position = errors(best.x)
    nominal = response.start.copy()
    nominal[-1] = 0.0
    speed_mps = float(np.nanmax(np.abs(tried.setpoint_mps)))
    return AxisFit(
        response.name,
        tuple(float(x) for x in best.x),
        response.derived(best.x, speed_mps),
        _rms(velocity),
        _rms(position),
        _rms(errors(nominal)[1]),
        tried.link_s,
    )


def _errors(p: Array, tried: Tried, response: Response) -> tuple[Array, Array]:
    grid_s, setpoint = on_grid(tried.sent_s, tried.setpoint_mps)
    speed = response.speeds(p, setpoint)
    place = np.cumsum(speed) * (grid_s[1] - grid_s[0])
    at_s = tried.seen_s - tried.sent_s[0]
    then_s = at_s - float(p[-1])
    velocity = tried.velocity_mps - np.interp(then_s, grid_s, speed, left=0.0)
    position = tried.position_m - np.interp(then_s, grid_s, place, left=0.0)
    window = max(1, round(SLOW_S / float(np.median(np.diff(at_s)))))
    return velocity, position - _running_mean(position, window)


def _running_mean(x: Array, window: int) -> Array:
    """Centred; shorter at the ends."""
    ones = np.ones(min(window, len(x)))
    return np.convolve(x, ones, "same") / np.convolve(np.ones(len(x)), ones, "same")


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x * x)))
