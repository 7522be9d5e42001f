"""From a request to a plan: try, check against the target, throw away what misses it, repeat."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from base_station.planning.alpha import AlphaTask
from base_station.planning.attempts import Attempt, Progress
from base_station.planning.beta import BetaTask, success_share
from base_station.planning.candidates import NOTHING, best_candidate, better, open_loop_plan
from base_station.planning.cem import cem
from base_station.planning.gradient import gradient
from base_station.planning.ppo import PAPER, TUNED_ALPHA, TUNED_BETA, Learned, Preset, train
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.ram import ram
from base_station.planning.requests import (
    OpenLoopPlan,
    PlanProgress,
    PlanReady,
    PlanRequest,
    PolicyWeights,
    Training,
)
from base_station.planning.search import Search, search
from base_station.planning.shooting import shooting
from base_station.planning.stepwise import stepwise
from hil.scenario import StationView

Array = NDArray[np.float64]
OnProgress = Callable[[PlanProgress], None]
Try = Callable[[StationView, PlanRequest, int, Progress], Attempt]

SUCCESS_ROLLOUTS = 64
SUCCESS_SHARE = 0.95
PRESETS: dict[tuple[str, str], Preset] = {
    ("tuned", "alpha"): TUNED_ALPHA,
    ("tuned", "beta"): TUNED_BETA,
    ("paper", "alpha"): PAPER,
    ("paper", "beta"): PAPER,
}
SEARCHES: dict[str, Search] = {
    "cem": cem,
    "shooting": shooting,
    "random": stepwise,
    "gradient": gradient,
    "ram": ram,
}


def plan(view: StationView, request: PlanRequest, on_progress: OnProgress) -> PlanReady:
    """Answer a request; the same request always gets the same answer but for `wall_s`."""
    name, attempt_once = try_of(view, request)
    trainings: list[Training] = []
    for k in range(view.planning.restarts + 1):

        def progress(timesteps: int, total: int, mean_reward: float, k: int = k) -> None:
            on_progress(
                PlanProgress(request.number, request.kind, k, timesteps, total, mean_reward)
            )

        done = attempt_once(view, request, derived_seed(request.seed, k), progress)
        trainings.append(_training(done, name, request.preset, k))
        if done.accepted:
            answer = tuple(trainings)
            return PlanReady(request.number, request.kind, answer, done.plan, done.policy)
    return PlanReady(request.number, request.kind, tuple(trainings))


def try_of(view: StationView, request: PlanRequest) -> tuple[str, Try]:
    """A planner's name and one attempt of it; the mission is learned, whatever the scenario says
    of the experiment."""
    if request.kind == "beta":
        return "ppo", learn_beta
    name = view.planning.planner
    return name, learn_alpha if name == "ppo" else partial(search_alpha, SEARCHES[name])


def search_alpha(
    proposals: Search, view: StationView, request: PlanRequest, seed: int, progress: Progress
) -> Attempt:
    """An experiment by a search that is given as many steps as a training."""
    problem, budget = alpha_problem(view, request), preset_of(request).total_timesteps
    return search(problem, proposals, seed, view.diagnosis.plan_error, budget, progress)


def learn_alpha(view: StationView, request: PlanRequest, seed: int, progress: Progress) -> Attempt:
    """An experiment that tells the request's hypotheses apart."""
    problem, preset, best = alpha_problem(view, request), preset_of(request), NOTHING

    def target(weights: PolicyWeights, log_std: Array) -> bool:
        nonlocal best
        best = better(best, best_candidate(problem, weights, log_std, seed))
        return best.error <= view.diagnosis.plan_error

    task = AlphaTask(problem, preset.environments, np.random.default_rng(seed))
    learned = train(task, preset, seed, target, partial(_forward, progress, preset))
    return _attempt(learned, found=open_loop_plan(problem, best))


def learn_beta(view: StationView, request: PlanRequest, seed: int, progress: Progress) -> Attempt:
    """A policy for what is left of the mission under the verdict."""
    problem, preset = beta_problem(view, request), preset_of(request)

    def target(weights: PolicyWeights, _log_std: Array) -> bool:
        rng = np.random.default_rng([seed, 1])
        return success_share(problem, weights, rng, SUCCESS_ROLLOUTS) >= SUCCESS_SHARE

    task = BetaTask(problem, preset.environments, np.random.default_rng(seed))
    learned = train(task, preset, seed, target, partial(_forward, progress, preset))
    return _attempt(learned, policy=learned.weights)


def preset_of(request: PlanRequest) -> Preset:
    return PRESETS[request.preset, request.kind]


def derived_seed(seed: int, attempt: int) -> int:
    """The seed of a restart: attempt k of a request always learns the same."""
    return int(np.random.SeedSequence([seed, attempt]).generate_state(1)[0] % 2**31)


def _forward(progress: Progress, preset: Preset, timesteps: int, mean_reward: float) -> None:
    progress(timesteps, preset.total_timesteps, mean_reward)


def _attempt(
    learned: Learned, found: OpenLoopPlan | None = None, policy: PolicyWeights | None = None
) -> Attempt:
    took = learned.timesteps, learned.wall_s
    return Attempt(learned.accepted, *took, learned.curve, found, policy)


def _training(done: Attempt, planner: str, preset: str, attempt: int) -> Training:
    return Training(
        planner, preset, attempt, done.accepted, done.timesteps, done.wall_s, done.curve
    )
