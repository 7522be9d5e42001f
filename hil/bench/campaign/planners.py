"""Who plans in a campaign: the project's planners, baselines, missions without learning.

A campaign runs thousands of times what a mission runs once, so by default nothing is learnt: the
experiment is searched for, and the mission is a policy whose weights are written down here.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import FAR_M, Commands, beta_observation
from base_station.planning.requests import (
    OpenLoopPlan,
    PlanProgress,
    PlanReady,
    PlanRequest,
    PolicyWeights,
    Training,
    decode,
)
from base_station.twin import FleetModel
from hil.bench.campaign.file import How
from hil.scenario import StationView

Array = NDArray[np.float64]
Learn = Callable[[StationView, PlanRequest, Callable[[PlanProgress], None]], PlanReady]
Mission = Callable[[StationView, PlanRequest], PolicyWeights]

HOMING_GAIN_PER_M = 1.5
HOMING_SPEED = 0.8  # of the fleet's limit
HIDDEN = 32


def home(view: StationView, request: PlanRequest) -> PolicyWeights:
    """Everybody straight to the goal, slower near it: v = 0.8 tanh(1.5 d), d in metres."""
    vehicles, inputs = len(view.fleet), _inputs(view, request)
    wanted = 2 * vehicles  # the observation begins with the way to the goals over FAR_M
    hidden = np.zeros((wanted, inputs))
    hidden[:, :wanted] = HOMING_GAIN_PER_M * FAR_M * np.eye(wanted)
    per_vehicle = Commands.of_view(view).size // vehicles
    last = np.zeros((vehicles * per_vehicle, wanted))
    for v in range(vehicles):
        for axis in (0, 1):
            last[per_vehicle * v + axis, 2 * v + axis] = HOMING_SPEED
    return PolicyWeights(((hidden, np.zeros(wanted)), (last, np.zeros(len(last)))))


def wander(view: StationView, request: PlanRequest) -> PolicyWeights:
    """Random weights: nowhere in particular, but briskly, into walls and each other."""
    rng = np.random.default_rng(request.seed)
    size = Commands.of_view(view).size
    hidden = rng.normal(0.0, 1.0, (HIDDEN, _inputs(view, request))), rng.normal(0.0, 1.0, HIDDEN)
    return PolicyWeights((hidden, (rng.normal(0.0, 0.4, (size, HIDDEN)), np.zeros(size))))


MISSIONS: dict[str, Mission | None] = {"home": home, "wander": wander, "ppo": None}  # None: learn


def saved_policy(text: str) -> PolicyWeights:
    """From the JSON line of a planner's answer. Raises ValueError, KeyError or TypeError."""
    answer = decode(text.strip())
    if not isinstance(answer, PlanReady) or not isinstance(answer.policy, PolicyWeights):
        raise ValueError("no policy in it")
    return answer.policy


def planner(how: How, policy: str, is_over: Callable[[], bool], learn: Learn) -> Learn:
    """Answers requests as `how` says, with `learn` for what is really planned.

    `policy` is the text of a saved one. When the run `is_over` nothing is planned any more.
    """

    def answer(
        view: StationView, request: PlanRequest, progress: Callable[[PlanProgress], None]
    ) -> PlanReady:
        if is_over():
            return _given(request, "none")
        if request.kind == "beta":
            if policy:
                return _given(request, "saved", policy=saved_policy(policy))
            mission = MISSIONS[how.mission]
            if mission is not None:
                return _given(request, how.mission, policy=mission(view, request))
        elif how.planner == "passive":
            return _given(request, "passive")
        elif how.planner == "still":
            return _given(request, "still", plan=_stay(view, request))
        return learn(view, request, progress)

    return answer


def _given(
    request: PlanRequest,
    name: str,
    plan: OpenLoopPlan | None = None,
    policy: PolicyWeights | None = None,
) -> PlanReady:
    training = Training(name, "none", 0, True, 0, 0.0, ())
    return PlanReady(request.number, request.kind, (training,), plan, policy)


def _stay(view: StationView, request: PlanRequest) -> OpenLoopPlan:
    """As long as any other plan, and nobody moves."""
    count, period_s = len(view.fleet), 1.0 / view.clock.control_hz
    steps = round(view.planning.alpha_horizon_s / period_s)
    setpoints = np.zeros((steps, count, 3))
    setpoints[:, :, 2] = np.nan
    reports = np.zeros((len(request.hypotheses), steps + 1, count, 2))
    return OpenLoopPlan(setpoints, period_s, tuple(range(count)), 0.5, reports)


def _inputs(view: StationView, request: PlanRequest) -> int:
    """How many numbers a mission's policy sees."""
    model = FleetModel.from_view(view)
    goals_m = np.array([[m.goal.north_m, m.goal.east_m] for m in view.fleet])
    delivered = np.zeros((1, model.size), dtype=np.bool_)
    return int(beta_observation(request.states, delivered, np.zeros(1), model, goals_m, 0).shape[1])
