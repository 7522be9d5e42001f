"""The twin that is believed, run beside the fleet: its residuals, its alarm, and its memory.

An observer: each tick the twin is moved on under the orders that were sent, compared with what was
received, and drawn towards it on the axes its hypothesis trusts. The residual is the difference
before the drawing, in units of its predicted spread.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station import detection, twin
from base_station.execution import Orders
from base_station.hypotheses import Hypothesis
from base_station.telemetry import Frame
from hil.scenario import StationView

Array = NDArray[np.float64]

CORRECTION_TIME_S = 1.0  # how fast the twin follows what is received
NOISE_SIGMA_M = 0.03  # of one report after the vehicle's filter
MOTION_ERROR = (
    0.30  # of the motion the twin expects: one sigma of rolling resistance is 18 % of a pulse
)
CONTACT_GAP_M = 0.15  # closer than this, vehicles or a vehicle and a wall may be touching ...
CONTACT_SIGMA_M = 0.30  # ... and how they slide along each other is beyond the twin
MEMORY_S = 60.0


@dataclass(frozen=True, eq=False)
class Moment:
    """One tick of the memory: what arrived, the orders before it, and the twin after it [V, S]."""

    frame: Frame
    orders: Orders
    state: Array


@dataclass(frozen=True, eq=False)
class Baseline:
    """Everything that is taken for granted: the model, and the faults already established."""

    model: twin.FleetModel
    known: tuple[Hypothesis, ...] = ()

    def faults(self, hypotheses: Sequence[Hypothesis]) -> twin.FaultArrays:
        """[H] fault rows of `hypotheses`, each on top of what is known."""
        rows = twin.fault_rows(self.model, hypotheses)
        if not self.known:
            return rows
        known = twin.fault_rows(self.model, self.known)
        return twin.FaultArrays(
            rows.power * known.power.min(axis=0),
            np.maximum(rows.gps_stuck, known.gps_stuck.max(axis=0)),
        )

    def with_known(self, hypothesis: Hypothesis) -> "Baseline":
        return replace(self, known=(*self.known, hypothesis))


def near_contact(position_m: Array, vehicles: twin.Vehicles) -> NDArray[np.bool_]:
    """[V]: which of positions [V, 2] are within CONTACT_GAP_M of another vehicle or of a wall."""
    radius_m, bounds_m = vehicles.radius_m, vehicles.bounds_m
    gaps = np.linalg.norm(position_m[:, None] - position_m[None, :], axis=-1)
    gaps = gaps - radius_m[:, None] - radius_m[None, :]
    np.fill_diagonal(gaps, np.inf)
    to_walls = np.hstack([position_m - bounds_m[[0, 2]], bounds_m[[1, 3]] - position_m])
    nearest = np.minimum(gaps.min(axis=1), to_walls.min(axis=1) - radius_m)
    return np.asarray(nearest < CONTACT_GAP_M)


def correct(states: Array, frame: Frame, trusted: NDArray[np.bool_], gain: float) -> Array:
    """States [H, V, S] drawn towards a frame where `trusted` [H, V, 2]; headings as received."""
    out = states.copy()
    position = out[..., twin.NORTH : twin.EAST + 1]
    known = trusted & frame.fresh[None, :, None]
    position += np.where(known, gain * (np.nan_to_num(frame.position_m) - position), 0.0)
    yaw = np.where(np.isnan(frame.yaw_rad), out[..., twin.YAW], frame.yaw_rad)
    out[..., twin.YAW] = yaw
    return out


class Watch:
    """Runs the believed twin tick by tick. `level` is compared with `threshold` for an alarm."""

    def __init__(self, view: StationView, baseline: Baseline, state: Array, time_s: float) -> None:
        self.baseline = baseline
        self._faults = baseline.faults((_nothing_more(view),))
        self._trusted = self._faults.gps_stuck < 0.5
        self._period_s = 1.0 / view.clock.telemetry_hz
        self.state = state
        self._model_sigma_m = np.zeros((len(view.fleet), 2))  # builds up and fades like the error
        self.travelled_m = [0.0] * len(view.fleet)  # by the twin, since this belief began
        self.threshold = detection.threshold(
            view.diagnosis.false_alarms_per_hour, view.clock.telemetry_hz, len(view.fleet)
        )
        self.cusum = detection.start(len(view.fleet), time_s)
        self.residual = np.full((len(view.fleet), 2), np.nan)
        self.contacts: tuple[tuple[int, int], ...] = ()
        self.memory: deque[Moment] = deque(maxlen=round(MEMORY_S / self._period_s))

    @property
    def report_m(self) -> Array:
        """[V, 2]: what the believed twin expects to receive."""
        return np.asarray(twin.report(self.state[None], self._faults)[0])

    @property
    def sigma_m(self) -> Array:
        """[V, 2]: one standard deviation of the residual before it is normalised."""
        return np.asarray(np.hypot(NOISE_SIGMA_M, self._model_sigma_m))

    def tick(self, frame: Frame, orders: Orders) -> tuple[int, ...]:
        """Move on under `orders` to `frame`; indices of the vehicles whose alarm stands now."""
        moved = twin.advance(
            self.baseline.model,
            self.baseline.model.nominal,
            self._faults,
            self.state[None],
            orders.setpoints,
            orders.driven,
            self._period_s,
        )
        self.contacts = tuple(
            (int(a), int(b)) for a, b in np.argwhere(moved.impulses_ns[0] > 0.0) if a < b
        )
        before, self.state = self.state, moved.states[0]
        steps = (self.state - before)[:, twin.NORTH : twin.EAST + 1]
        gain = self._period_s / CORRECTION_TIME_S
        self._model_sigma_m = self._grown_sigma(steps, gain, frame)
        self.travelled_m = [
            m + float(np.hypot(*d)) for m, d in zip(self.travelled_m, steps, strict=True)
        ]
        self.residual = (frame.position_m - self.report_m) / self.sigma_m
        self.cusum = detection.update(self.cusum, self.residual, frame.time_s)
        self.state = correct(moved.states, frame, self._trusted, gain)[0]
        self.memory.append(Moment(frame, orders, self.state))
        return tuple(int(v) for v in np.flatnonzero(self.cusum.level.max(axis=1) > self.threshold))

    def _grown_sigma(self, steps_m: Array, gain: float, frame: Frame) -> Array:
        """[V, 2]: the twin's own error after one more tick in which it moved by `steps_m`."""
        grown = (1.0 - gain) * self._model_sigma_m + MOTION_ERROR * np.abs(steps_m)
        believed_m = self.state[:, twin.NORTH : twin.EAST + 1]
        seen_m = np.where(frame.fresh[:, None], frame.position_m, believed_m)
        vehicles = self.baseline.model.vehicles
        touching = near_contact(believed_m, vehicles) | near_contact(seen_m, vehicles)
        return np.where(touching[:, None], np.maximum(grown, CONTACT_SIGMA_M), grown)


def _nothing_more(view: StationView) -> Hypothesis:
    return Hypothesis("none", view.fleet[0].sysid, 1.0)
