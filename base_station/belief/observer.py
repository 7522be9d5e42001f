"""An ensemble of twins beside the fleet: what is expected next, and how sure that is.

Every member has parameters of its own, drawn from what the data sheets leave open, and sees the
reports with a constant error of its own. So the spread of the members grows where gains, rolling
resistance, latency or the geometry of a contact matter, and shrinks at rest. Member 0 is nominal:
it is the state that is believed.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.belief import hearing
from base_station.belief.hearing import Hearing
from base_station.execution import Orders
from base_station.receiving.telemetry import Frame

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

MEMBERS = 16
REPORT_ERROR_M = 0.01  # slow error of a report: GPS wander, what is left of noise after a second
SLIP = 0.3  # of the motion in a contact
DRAW = 0  # the ensemble is a set of test points, not an experiment: the same ones every time


@dataclass(frozen=True, eq=False)
class Observer:
    """M members: `parameters` (P = M), `report_error_m` [M, V, 2], `states` [M, V, S].

    Each has heard of the orders what its link let through. `slack_m` [V]: how far off a vehicle may
    be because it touches another: who slips where is not for a twin of discs to know.
    """

    parameters: twin.Parameters
    report_error_m: Array
    states: Array
    hearing: Hearing
    slack_m: Array


def start(model: twin.FleetModel, state: Array) -> Observer:
    """All members at one state [V, S]."""
    rng = np.random.default_rng(DRAW)
    drawn = twin.perturbed(model, rng, MEMBERS)
    for nominal, draws in zip(model.nominal, drawn, strict=True):
        draws[0] = nominal[0]
    error_m = REPORT_ERROR_M * rng.standard_normal((MEMBERS, model.size, 2))
    error_m[0] = 0.0
    heard = hearing.nothing_yet(MEMBERS, model.size)
    states = np.repeat(state[None], MEMBERS, axis=0)
    return Observer(drawn, error_m, states, heard, np.zeros(model.size))


def moved(
    observer: Observer,
    model: twin.FleetModel,
    faults: twin.FaultArrays,
    orders: Orders,
    frame: Frame,
    period_s: float,
) -> tuple[Observer, Array]:
    """Every member after one more period, to `frame`; impulses [V, V] (N s) of member 0."""
    heard = hearing.heard(observer.hearing, orders, frame, period_s)
    setpoints, driven = heard.of_rows(MEMBERS)
    after = twin.advance(
        model, observer.parameters, faults, observer.states, setpoints, driven, period_s
    )
    slack_m = observer.slack_m + _slip_m(observer.states, after.states, after.impulses_ns)
    moved = replace(observer, states=after.states, hearing=heard, slack_m=slack_m)
    return moved, after.impulses_ns[0]


def _slip_m(before: Array, after: Array, impulses_ns: Array) -> Array:
    """[V]: a share of the way that it, or who touches it in any member, has just moved."""
    steps = (after - before)[..., twin.NORTH : twin.EAST + 1]
    way_m = np.hypot(steps[..., 0], steps[..., 1]).max(axis=0)
    touch = (impulses_ns > 0.0).any(axis=0)
    touch |= touch.T
    moved_m = np.where(touch, np.maximum(way_m, way_m[:, None]), 0.0)
    return np.asarray(SLIP * moved_m.max(axis=1))


def spread_m(reports_m: Array) -> Array:
    """[V, 2] root mean square of the members' reports [M, V, 2] around that of member 0."""
    return np.asarray(np.sqrt(np.mean((reports_m - reports_m[0]) ** 2, axis=0)))


def drawn(observer: Observer, frame: Frame, trusted: Flags, gain: Array) -> Observer:
    """Every member drawn by `gain` [V, 1] towards what it sees of a frame; `trusted` [V, 2]."""
    seen_m = frame.position_m + observer.report_error_m
    states = corrected(observer.states, frame, seen_m, trusted[None], gain)
    slack_m = np.where(frame.fresh, (1.0 - gain[:, 0]) * observer.slack_m, observer.slack_m)
    return replace(observer, states=states, slack_m=slack_m)


def at_rest(observer: Observer, frame: Frame, trusted: Flags) -> Observer:
    """All members where `frame` sees the fleet, where `trusted` [V, 2], and standing."""
    there = drawn(observer, frame, trusted, np.ones((1, 1)))
    for column in (twin.V_NORTH, twin.V_EAST, twin.YAW_RATE, twin.I_X, twin.I_Y):
        there.states[..., column] = 0.0
    return replace(
        there,
        hearing=hearing.nothing_yet(MEMBERS, len(frame.fresh)),
        slack_m=np.zeros(len(frame.fresh)),
    )


def corrected(states: Array, frame: Frame, seen_m: Array, trusted: Flags, gain: Array) -> Array:
    """States [R, V, S] drawn towards positions `seen_m` [..., V, 2] where `trusted` [R or 1, V, 2].

    By `gain` [V or 1, 1]; only vehicles of which `frame` is fresh; headings as received.
    """
    out = states.copy()
    position = out[..., twin.NORTH : twin.EAST + 1]
    known = trusted & frame.fresh[None, :, None]
    position += np.where(known, gain * (np.nan_to_num(seen_m) - position), 0.0)
    yaw = np.where(np.isnan(frame.yaw_rad), out[..., twin.YAW], frame.yaw_rad)
    out[..., twin.YAW] = yaw
    return out
