"""Plans and the time since they began, to orders for the fleet (pure)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.requests import OpenLoopPlan
from hil.frames import body_to_ned
from hil.scenario import StationView

Array = NDArray[np.float64]

REST_S = 1.5  # at least: a rover at the speed limit coasts to rest in 1 s or a little more
SETTLE_S = 0.8  # a pulse coasts out within 0.4 s; the rest averages noise
SPACING_M = 0.35  # gap below which a rover on its way back bends around another


@dataclass(frozen=True)
class Orders:
    """What every vehicle is told now, in fleet order.

    `setpoints` [V, 3]: north and east (m/s) and yaw (rad, NaN: not commanded). `driven` [V]: GUIDED
    with these set-points; where False the vehicle waits in HOLD, motors zero.
    """

    setpoints: Array
    driven: NDArray[np.bool_]


def hold(vehicles: int) -> Orders:
    """Everybody in HOLD: how every pulse, every plan and every abort ends."""
    setpoints = np.zeros((vehicles, 3))
    setpoints[:, 2] = np.nan
    return Orders(setpoints, np.zeros(vehicles, dtype=np.bool_))


@dataclass(frozen=True)
class Pulse:
    """One tiny displacement: vehicle index, body axis (0 x, 1 y) and direction."""

    vehicle: int
    axis: int
    sign: int


def probe_pulses(vehicles: int) -> tuple[Pulse, ...]:
    """[0a] one axis of one vehicle after the other, there and back."""
    return tuple(Pulse(v, a, s) for v in range(vehicles) for a in (0, 1) for s in (1, -1))


def pulses_of(view: StationView) -> tuple[Pulse, ...]:
    """Those that a fleet can answer: who steers by turning goes forward and no other way."""
    pulses = probe_pulses(len(view.fleet))
    turns = [member.frame.steering == "skid" for member in view.fleet]
    return tuple(p for p in pulses if not turns[p.vehicle] or (p.axis, p.sign) == (0, 1))


def pulse_at(
    pulses: Sequence[Pulse], elapsed_s: float, view: StationView
) -> tuple[Pulse | None, bool]:
    """The pulse whose turn it is (None: all done), and whether it is driven or settling."""
    period_s = view.limits.probe_pulse_s + SETTLE_S
    index = int((elapsed_s + 1e-6) / period_s)
    if index >= len(pulses):
        return None, False
    return pulses[index], elapsed_s - index * period_s < view.limits.probe_pulse_s - 1e-6


def pulse_orders(pulse: Pulse, yaw_rad: float, view: StationView) -> Orders:
    """A velocity pulse along a body axis; all others hold."""
    orders = hold(len(view.fleet))
    speed_mps = pulse.sign * view.limits.probe_speed_mps
    body = (speed_mps, 0.0) if pulse.axis == 0 else (0.0, speed_mps)
    orders.setpoints[pulse.vehicle, :2] = body_to_ned(*body, yaw_rad)
    orders.driven[pulse.vehicle] = True
    return orders


def plan_orders(plan: OpenLoopPlan, elapsed_s: float) -> Orders | None:
    """The row of an open-loop plan that is due; None when the plan is over."""
    row = int((elapsed_s + 1e-6) / plan.period_s)
    if row >= len(plan.setpoints):
        return None
    driven = np.ones(plan.setpoints.shape[1], dtype=np.bool_)
    driven[list(plan.held)] = False
    return Orders(plan.setpoints[row].copy(), driven)


def return_orders(
    position_m: Array, goals_m: Array, home: NDArray[np.bool_], view: StationView
) -> Orders:
    """Send those that are not home straight back to their goals, around whoever is in the way.

    `position_m`, `goals_m` [V, 2]; `home` [V] stays in HOLD. The pull is proportional, the push
    away from a neighbour grows as the gap closes and has a sideways part, so that a rover slides
    around instead of stopping face to face (an artificial potential field, Khatib 1986).
    """
    orders = hold(len(position_m))
    radii = np.array([m.frame.radius_m for m in view.fleet])
    for v in np.flatnonzero(~home):
        pull = 1.2 * (goals_m[v] - position_m[v])
        velocity = pull * min(1.0, 0.6 * view.limits.speed_mps / max(1e-9, float(np.hypot(*pull))))
        for other in range(len(position_m)):
            apart = position_m[v] - position_m[other]
            distance_m = float(np.hypot(*apart))
            gap_m = distance_m - radii[v] - radii[other]
            if other == v or gap_m >= SPACING_M or distance_m == 0.0:
                continue
            away = apart / distance_m
            toward = float(velocity @ -away)
            if toward > 0.0:
                side = np.array([-away[1], away[0]])
                side = side if side @ pull >= 0.0 else -side
                velocity = velocity + toward * (1.0 - max(gap_m, 0.0) / SPACING_M) * (away + side)
        orders.setpoints[v, :2] = velocity
        orders.driven[v] = True
    return orders
