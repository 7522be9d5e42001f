"""From a request to a plan: learn, check against the target, throw away what misses it, repeat."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.alpha import AlphaProblem, AlphaTask, nominal_actions
from base_station.planning.beta import BetaProblem, BetaTask, success_share
from base_station.planning.evaluation import plan_errors, predict
from base_station.planning.policy import Commands, to_setpoints
from base_station.planning.ppo import PAPER, TUNED_ALPHA, TUNED_BETA, Learned, Preset, Target, train
from base_station.planning.requests import (
    OpenLoopPlan,
    PlanProgress,
    PlanReady,
    PlanRequest,
    PolicyWeights,
    Training,
)
from base_station.planning.tasks import Task
from base_station.twin import YAW, FaultArrays, FleetModel, fault_rows
from hil.scenario import StationView

Array = NDArray[np.float64]
OnProgress = Callable[[PlanProgress], None]

CANDIDATES = 16  # the mode of the policy and 15 samples of it
SUCCESS_ROLLOUTS = 64
SUCCESS_SHARE = 0.95
PRESETS: dict[tuple[str, str], Preset] = {
    ("tuned", "alpha"): TUNED_ALPHA,
    ("tuned", "beta"): TUNED_BETA,
    ("paper", "alpha"): PAPER,
    ("paper", "beta"): PAPER,
}


@dataclass(frozen=True, eq=False)
class Candidate:
    """The best plan found by a look at an alpha policy."""

    error: float
    setpoints: Array  # [K, V, 3]


def plan(view: StationView, request: PlanRequest, on_progress: OnProgress) -> PlanReady:
    """Answer a request; the same request always gets the same answer but for `wall_s`."""
    if request.kind == "alpha":
        return plan_alpha(view, request, on_progress)
    return plan_beta(view, request, on_progress)


def plan_alpha(view: StationView, request: PlanRequest, on_progress: OnProgress) -> PlanReady:
    """An experiment that tells the request's hypotheses apart."""
    problem, preset = alpha_problem(view, request), preset_of(request)
    trainings: list[Training] = []
    for attempt in range(view.planning.restarts + 1):
        seed = derived_seed(request.seed, attempt)
        best = Candidate(np.inf, np.empty(0))

        def target(weights: PolicyWeights, log_std: Array, seed: int = seed) -> bool:
            nonlocal best
            best = min(best, best_candidate(problem, weights, log_std, seed), key=_error)
            return best.error <= view.diagnosis.plan_error

        task = AlphaTask(problem, preset.environments, np.random.default_rng(seed))
        learned = _learn(task, preset, seed, target, request, attempt, on_progress)
        trainings.append(_training(learned, request, attempt))
        if learned.accepted:
            found = open_loop_plan(problem, best)
            return PlanReady(request.number, "alpha", tuple(trainings), plan=found)
    return PlanReady(request.number, "alpha", tuple(trainings))


def plan_beta(view: StationView, request: PlanRequest, on_progress: OnProgress) -> PlanReady:
    """A policy for what is left of the mission under the verdict."""
    problem, preset = beta_problem(view, request), preset_of(request)
    trainings: list[Training] = []
    for attempt in range(view.planning.restarts + 1):
        seed = derived_seed(request.seed, attempt)

        def target(weights: PolicyWeights, _log_std: Array, seed: int = seed) -> bool:
            rng = np.random.default_rng([seed, 1])
            return success_share(problem, weights, rng, SUCCESS_ROLLOUTS) >= SUCCESS_SHARE

        task = BetaTask(problem, preset.environments, np.random.default_rng(seed))
        learned = _learn(task, preset, seed, target, request, attempt, on_progress)
        trainings.append(_training(learned, request, attempt))
        if learned.accepted:
            return PlanReady(request.number, "beta", tuple(trainings), policy=learned.weights)
    return PlanReady(request.number, "beta", tuple(trainings))


def preset_of(request: PlanRequest) -> Preset:
    return PRESETS[request.preset, request.kind]


def derived_seed(seed: int, attempt: int) -> int:
    """The seed of a restart: attempt k of a request always learns the same."""
    return int(np.random.SeedSequence([seed, attempt]).generate_state(1)[0] % 2**31)


def alpha_problem(view: StationView, request: PlanRequest) -> AlphaProblem:
    """The suspect waits in HOLD when the view says so; with free yaw, turning it is the better
    experiment, so then it may be commanded."""
    model = FleetModel.from_view(view)
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
    )


def best_candidate(
    problem: AlphaProblem, weights: PolicyWeights, log_std: Array, seed: int
) -> Candidate:
    """The best at the declared percentile among the policy's mode and samples of it."""
    rng = np.random.default_rng([seed, 1])
    mode = nominal_actions(problem, weights)
    noise = rng.standard_normal((CANDIDATES - 1, *mode.shape)) * np.exp(log_std)
    plans = to_setpoints(np.concatenate([mode[None], mode + noise]), problem.commands)
    errors = plan_errors(
        problem.model,
        problem.faults,
        problem.start,
        plans,
        problem.commands.driven,
        problem.period_s,
        rng,
    )
    best = int(np.argmin(errors))
    return Candidate(float(errors[best]), plans[best])


def open_loop_plan(problem: AlphaProblem, found: Candidate) -> OpenLoopPlan:
    """The candidate with what each nominal twin expects the station to receive."""
    nominal = predict(
        problem.model,
        problem.model.nominal,
        problem.faults,
        problem.start[None],
        found.setpoints[None],
        problem.commands.driven,
        problem.period_s,
    )
    held = tuple(int(v) for v in np.flatnonzero(~problem.commands.driven))
    return OpenLoopPlan(found.setpoints, problem.period_s, held, found.error, nominal.reports[0])


def beta_problem(view: StationView, request: PlanRequest) -> BetaProblem:
    model, verdict = FleetModel.from_view(view), request.hypotheses[0]
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


def _error(candidate: Candidate) -> float:
    return candidate.error


def _learn(
    task: Task,
    preset: Preset,
    seed: int,
    target: Target,
    request: PlanRequest,
    attempt: int,
    on_progress: OnProgress,
) -> Learned:
    def progress(timesteps: int, mean_reward: float) -> None:
        total = preset.total_timesteps
        on_progress(
            PlanProgress(request.number, request.kind, attempt, timesteps, total, mean_reward)
        )

    return train(task, preset, seed, target, progress)


def _training(learned: Learned, request: PlanRequest, attempt: int) -> Training:
    return Training(
        planner="ppo_mlp",
        preset=request.preset,
        attempt=attempt,
        accepted=learned.accepted,
        timesteps=learned.timesteps,
        wall_s=learned.wall_s,
        curve=learned.curve,
    )
