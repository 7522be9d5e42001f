"""Which experiment next: none, the suspect alone, or contact (pure).

Ordinary driving has been judged before. What the suspect can be told apart by alone costs a few
seconds; contact is for explanations that call for different remedies.
"""

import itertools

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.belief.doubt import Doubt
from base_station.belief.hypotheses import Hypothesis
from base_station.planning.requests import OpenLoopPlan
from hil.faults import Type, Unit
from hil.frames import body_to_ned
from hil.scenario import StationView

Array = NDArray[np.float64]

PLAUSIBLE = 0.005  # explanations less likely than this are not worth an experiment
APART_M = 0.15  # reports that differ by this are told apart: five sigma
PULSE_S, REST_S = 1.0, 1.0  # at full speed: what a weak motor does at walking pace is friction's
TURNING_PULSE_S = 1.5  # of who turns before it gets anywhere
PUSH, RECKON = "push", "reckon"
WEAK = 0.5  # a motor with less than this of its force is no use


def remedy(hypothesis: Hypothesis) -> str:
    """What a mission has to do about a fault; explanations with one remedy need no contact."""
    fault = hypothesis.fault
    if fault is None:
        return hypothesis.name
    if fault.unit is Unit.MOTOR:
        weak = fault.type is not Type.PARTIAL or fault.size[0] < WEAK
        return f"{PUSH} {fault.instances}" if weak else "drive"
    if fault.type is Type.STUCK:
        return f"{RECKON} {fault.axes}"
    return RECKON if fault.type is Type.DRIFT else "filter"


def remedy_posterior(doubt: Doubt) -> float:
    """Probability of all explanations that share the remedy of the most probable one."""
    posterior = doubt.posterior
    remedies = [remedy(doubt.estimated(t)) for t in range(len(doubt.twins))]
    remedies += [h.name for h in doubt.hypotheses[len(doubt.twins) :]]
    best = remedies[int(posterior.argmax())]
    return float(sum(p for p, r in zip(posterior, remedies, strict=True) if r == best))


def plausible(doubt: Doubt) -> list[int]:
    """Indices of twins that are still to be reckoned with; at least one."""
    p = doubt.posterior[: len(doubt.twins)]
    return [t for t in range(len(p)) if p[t] >= PLAUSIBLE] or [int(p.argmax())]


def for_contact(doubt: Doubt) -> list[int]:
    """Of the plausible twins one for each remedy, as far as a push can tell; at least two."""
    p = doubt.posterior[: len(doubt.twins)]
    likely = plausible(doubt)
    chosen: dict[str, int] = {}
    for t in sorted(range(len(p)), key=lambda t: -p[t]):
        if t in likely or len(chosen) < 2:
            chosen.setdefault(_way_to_move(doubt.estimated(t)), t)
    return sorted(chosen.values())


def _way_to_move(hypothesis: Hypothesis) -> str:
    fault = hypothesis.fault
    if fault is None or (fault.unit is Unit.GPS and fault.type is not Type.STUCK):
        return "as ordered"
    return remedy(hypothesis)


def solo(doubt: Doubt, view: StationView) -> OpenLoopPlan | None:
    """The suspect there and back along both body axes; None when that would tell nothing apart.

    Each way begins where there is more room.
    """
    likely = plausible(doubt)
    plan = _solo_setpoints(doubt, view)
    reports_m = _predicted(doubt, view, plan, likely)
    apart = any(
        _tells(doubt.twins[a], doubt.twins[b], reports_m[:, i], reports_m[:, j])
        for (i, a), (j, b) in itertools.combinations(enumerate(likely), 2)
    )
    held = tuple(v for v in range(len(view.fleet)) if v != doubt.suspect)
    period_s = 1.0 / view.clock.control_hz
    predicted = np.moveaxis(reports_m, 0, 1)
    return OpenLoopPlan(plan, period_s, held, float("nan"), predicted) if apart else None


def _tells(one: Hypothesis, other: Hypothesis, one_m: Array, other_m: Array) -> bool:
    """Whether two explanations expect different reports; time alone tells faults of reports."""
    kinds = {h.kind for h in (one, other)}
    in_time = {(Unit.GPS, k) for k in (Type.DRIFT, Type.NOISE, Type.DELAY)}
    return bool(kinds & in_time) or float(np.abs(one_m - other_m).max()) > APART_M


def _solo_setpoints(doubt: Doubt, view: StationView) -> Array:
    """[K, V, 3] pulses and rests of the suspect."""
    state = doubt.of_twins()[0][int(np.argmax(doubt.posterior[: len(doubt.twins)]))]
    here_m, yaw = state[doubt.suspect, : twin.EAST + 1], float(state[doubt.suspect, twin.YAW])
    period_s = 1.0 / view.clock.control_hz
    turns_first = bool(doubt.baseline.model.vehicles.heading_first[doubt.suspect])
    pulse_s = TURNING_PULSE_S if turns_first else PULSE_S
    drive, rest = (max(1, round(s / period_s)) for s in (pulse_s, REST_S))
    setpoints = np.zeros((4 * (drive + rest), len(view.fleet), 3))
    setpoints[..., 2] = np.nan
    row = 0
    for axis in range(2):
        forward = np.array(body_to_ned(*((1.0, 0.0) if axis == 0 else (0.0, 1.0)), yaw))
        sign = max((1.0, -1.0), key=lambda s: _room_m(here_m, s * forward, state, doubt))
        for way in (sign, -sign):
            velocity = way * view.limits.speed_mps * forward
            setpoints[row : row + drive, doubt.suspect, :2] = velocity
            row += drive + rest
    return setpoints


def _room_m(here_m: Array, direction: Array, state: Array, doubt: Doubt) -> float:
    """How far a point a metre ahead is from walls and neighbours."""
    ahead_m = here_m + direction
    north_min, north_max, east_min, east_max = doubt.baseline.model.vehicles.bounds_m
    walls = min(
        ahead_m[0] - north_min, north_max - ahead_m[0], ahead_m[1] - east_min, east_max - ahead_m[1]
    )
    others = np.delete(state[:, : twin.EAST + 1], doubt.suspect, axis=0)
    gaps = np.linalg.norm(others - ahead_m, axis=1)
    return float(min(walls, gaps.min(initial=np.inf)))


def _predicted(doubt: Doubt, view: StationView, plan: Array, likely: list[int]) -> Array:
    """[K + 1, T', V, 2] what each of the likely twins expects to be received."""
    hypotheses = [doubt.estimated(t) for t in likely]
    faults = doubt.baseline.faults(hypotheses)
    states = doubt.of_twins()[0][likely]
    driven = np.zeros(len(view.fleet), dtype=np.bool_)
    driven[doubt.suspect] = True
    reports_m = [twin.report(states, faults)]
    model, period_s = doubt.baseline.model, 1.0 / view.clock.control_hz
    for row in plan:
        moved = twin.advance(model, model.nominal, faults, states, row, driven, period_s)
        states = moved.states
        reports_m.append(twin.report(states, faults))
    return np.stack(reports_m)
