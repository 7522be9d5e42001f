"""From a request to a plan: try, check against the target, throw away what misses it, repeat."""

from base_station.planning.attempts import (
    Attempt,
    Attempts,
    OnProgress,
    derived_seed,
    numbered,
)
from base_station.planning.requests import PlanReady, PlanRequest, Training
from base_station.planning.trying import try_of
from hil.scenario import StationView


def in_turn(
    view: StationView, request: PlanRequest, on_progress: OnProgress
) -> tuple[Attempt, ...]:
    """One attempt after the other until one is accepted or the restarts are used up."""
    _, attempt_once = try_of(view, request)
    done: list[Attempt] = []
    while len(done) <= view.planning.restarts and not (done and done[-1].accepted):
        k = len(done)
        progress = numbered(request, k, on_progress)
        done.append(attempt_once(view, request, derived_seed(request.seed, k), progress))
    return tuple(done)


def plan(
    view: StationView,
    request: PlanRequest,
    on_progress: OnProgress,
    attempts: Attempts = in_turn,
) -> PlanReady:
    """Answer a request; the same request always gets the same answer but for `wall_s`."""
    name, _ = try_of(view, request)
    done = attempts(view, request, on_progress)
    trainings = tuple(
        Training(name, request.preset, k, a.accepted, a.timesteps, a.wall_s, a.curve)
        for k, a in enumerate(done)
    )
    if not done[-1].accepted:
        return PlanReady(request.number, request.kind, trainings)
    found = done[-1].plan, done[-1].policy, done[-1].predicted_m
    return PlanReady(request.number, request.kind, trainings, *found)
