"""From the station's view and a request to what is to be solved (pure)."""

import numpy as np
from numpy.typing import NDArray

from base_station.fitted import fleet_model
from base_station.planning.policy import Commands
from base_station.planning.requests import PlanRequest
from base_station.planning.tasks.alpha import AlphaProblem
from base_station.planning.tasks.beta import BetaProblem
from base_station.planning.tasks.limits import Limits
from base_station.planning.tasks.objectives import Information, Objective, PaperDistance
from base_station.twin import YAW, FaultArrays, FleetModel, fault_rows
from hil.scenario import StationView

Array = NDArray[np.float64]


def alpha_problem(view: StationView, request: PlanRequest) -> AlphaProblem:
    """The suspect waits in HOLD when the view says so; with free yaw, turning it is the better
    experiment, so then it may be commanded."""
    model = fenced(view)
    suspect = model.index(request.hypotheses[0].sysid)
    held = view.planning.suspect == "held" and view.yaw == "locked" and model.size > 1
    return AlphaProblem(
        model=model,
        faults=fault_rows(model, request.hypotheses),
        start=request.states,
        commands=Commands.of_view(view, held=(suspect,) if held else ()),
        suspect=suspect,
        period_s=1.0 / view.clock.control_hz,
        steps=round(view.planning.alpha_horizon_s * view.clock.control_hz),
        limits=Limits.of_view(view, suspect, request.states, model),
        objective=objective_of(view.planning.objective, request.posterior),
        declared=view.uncertainty,
        weights=tuple(p / sum(request.posterior) for p in request.posterior),
    )


def objective_of(name: str, posterior: tuple[float, ...]) -> Objective:
    """Raises KeyError for an objective that there is not."""
    total = sum(posterior)
    known: dict[str, Objective] = {
        "paper_distance": PaperDistance(),
        "paper_printed": PaperDistance(own_state=False),
        "information": Information(tuple(p / total for p in posterior)),
    }
    return known[name]


def beta_problem(view: StationView, request: PlanRequest) -> BetaProblem:
    model, verdict = fenced(view), request.hypotheses[0]
    faults, start = fault_rows(model, (verdict,)), request.states[0]
    paper = request.preset == "paper"
    return BetaProblem(
        model=model,
        faults=faults,
        start=start,
        delivered=np.array(request.delivered, dtype=np.bool_),
        goals_m=np.array([[m.goal.north_m, m.goal.east_m] for m in view.fleet]),
        commands=Commands.of_view(view),
        broken=None if verdict.fault is None else model.index(verdict.sysid),
        blocked=blocked_directions(model, faults, start, model.index(verdict.sysid)),
        radius_m=view.limits.goal_radius_m,
        period_s=1.0 / view.clock.control_hz,
        steps=round(view.planning.beta_horizon_s * view.clock.control_hz),
        base="paper" if paper else "delivered",
        shaped=not paper,
        curriculum=not paper,
    )


def fenced(view: StationView) -> FleetModel:
    """The fleet to plan with: a geofence counts as a wall, which no plan may touch."""
    model = fleet_model(view)
    return model.within(view.geofence) if view.geofence else model


def blocked_directions(model: FleetModel, faults: FaultArrays, start: Array, v: int) -> Array:
    """Projector [2, 2] (north, east) on where vehicle `v` can't drive itself; 0 if it can turn."""
    blocked = np.zeros((2, 2))
    if not model.vehicles.yaw_locked:
        return blocked
    c, s = np.cos(start[v, YAW]), np.sin(start[v, YAW])
    for k, axis in enumerate(np.array([[c, s], [-s, c]])):
        pull = faults.power[0, v] * np.abs(model.vehicles.direction[v, :, k])
        if pull.max() < 0.5:
            blocked += np.outer(axis, axis)
    return blocked
