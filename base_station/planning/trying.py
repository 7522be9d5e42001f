"""One attempt of each planner, all behind one interface: view, request, seed and progress."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from base_station.planning.actors import Actor, Gaussian
from base_station.planning.attempts import Attempt, Progress, Try
from base_station.planning.foresight import way
from base_station.planning.learning.discrete import command_list
from base_station.planning.learning.dqn import learn_dqn
from base_station.planning.learning.lesson import Learned, Lesson
from base_station.planning.learning.ppo import train, train_lstm
from base_station.planning.learning.presets import PRESETS, Preset
from base_station.planning.learning.qtable import learn_table
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.requests import PlanRequest, Script
from base_station.planning.scripted.nose_first import Scene, nose_first, without_drive
from base_station.planning.scripted.ram import ram
from base_station.planning.searches.cem import cem
from base_station.planning.searches.gradient import gradient
from base_station.planning.searches.search import Search, search
from base_station.planning.searches.shooting import shooting
from base_station.planning.searches.stepwise import stepwise
from base_station.planning.tasks.alpha import AlphaProblem, AlphaTask
from base_station.planning.tasks.beta import (
    BetaProblem,
    BetaTask,
    brought_home,
    policy_of,
    success_share,
)
from base_station.planning.tasks.candidates import (
    NOTHING,
    Candidate,
    best_candidate,
    better,
    open_loop_plan,
)
from hil.scenario import StationView

Learn = Callable[[Lesson, StationView, AlphaProblem], Learned]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

RULE = "nose_first"
SUCCESS_ROLLOUTS = 64
SUCCESS_SHARE = 0.95
SEARCHES: dict[str, Search] = {
    "cem": cem,
    "shooting": shooting,
    "random": stepwise,
    "gradient": gradient,
    "ram": ram,
}


def try_of(view: StationView, request: PlanRequest) -> tuple[str, Try]:
    """A planner's name and one attempt of it."""
    if request.kind == "beta":
        return ("ppo", learn_beta) if view.planning.mission == "ppo" else (RULE, try_rule)
    name = view.planning.planner
    if name in SEARCHES:
        return name, partial(search_alpha, SEARCHES[name])
    return name, partial(learn_alpha, LEARNERS[name])


def search_alpha(
    proposals: Search, view: StationView, request: PlanRequest, seed: int, progress: Progress
) -> Attempt:
    """An experiment by a search that is given as many steps as a training."""
    problem, budget = alpha_problem(view, request), preset_of(request).total_timesteps
    return search(problem, proposals, seed, view.diagnosis.plan_error, budget, progress)


def learn_alpha(
    learn: Learn, view: StationView, request: PlanRequest, seed: int, progress: Progress
) -> Attempt:
    """An experiment that tells the request's hypotheses apart, by a learner."""
    problem, preset = alpha_problem(view, request), preset_of(request)
    done, best = taught(learn, view, problem, preset, seed, partial(_forward, progress, preset))
    took = done.accepted, done.timesteps, done.wall_s, done.curve
    return Attempt(*took, plan=open_loop_plan(problem, best))


def taught(
    learn: Learn,
    view: StationView,
    problem: AlphaProblem,
    preset: Preset,
    seed: int,
    on_progress: Callable[[int, float], None],
) -> tuple[Learned, Candidate]:
    """A learner's training for an experiment, and the best plan that any look at it has found."""
    best = NOTHING

    def target(actor: Actor) -> bool:
        nonlocal best
        best = better(best, best_candidate(problem, actor, seed))
        return best.error <= view.diagnosis.plan_error

    task = AlphaTask(problem, preset.environments, np.random.default_rng(seed))
    done = learn(Lesson(task, preset, seed, target, on_progress), view, problem)
    return done, best


def learn_beta(view: StationView, request: PlanRequest, seed: int, progress: Progress) -> Attempt:
    """A policy for what is left of the mission under the verdict."""
    problem, preset = beta_problem(view, request), preset_of(request)
    return taught_mission(problem, preset, seed, partial(_forward, progress, preset))


def taught_mission(
    problem: BetaProblem, preset: Preset, seed: int, on_progress: Callable[[int, float], None]
) -> Attempt:
    """A training for the mission."""

    def target(actor: Actor) -> bool:
        assert isinstance(actor, Gaussian)
        rng = np.random.default_rng([seed, 1])
        return success_share(problem, actor.weights, rng, SUCCESS_ROLLOUTS) >= SUCCESS_SHARE

    task = BetaTask(problem, preset.environments, np.random.default_rng(seed))
    done = train(Lesson(task, preset, seed, target, on_progress))
    assert isinstance(done.actor, Gaussian)
    took = done.accepted, done.timesteps, done.wall_s, done.curve
    weights = done.actor.weights
    return Attempt(*took, policy=weights, predicted_m=way(problem, policy_of(problem, weights)))


def try_rule(view: StationView, request: PlanRequest, seed: int, progress: Progress) -> Attempt:
    """The rule, if it brings the fleet home in the twin."""
    began_s = time.perf_counter()
    problem = beta_problem(view, request)
    lost = without_drive(problem.model, problem.faults, problem.broken)
    scene = Scene(
        problem.model,
        problem.goals_m,
        problem.commands,
        problem.radius_m,
        problem.broken,
        lost,
    )

    def play(states: Array, delivered: Flags, _k: int) -> Array:
        return nose_first(scene, states, delivered)

    home = brought_home(problem, play, np.random.default_rng([seed, 1]), SUCCESS_ROLLOUTS)
    share, steps = float(home.mean()), SUCCESS_ROLLOUTS * problem.steps
    progress(steps, steps, share)
    return Attempt(
        share >= SUCCESS_SHARE,
        steps,
        time.perf_counter() - began_s,
        ((float(steps), share),),
        policy=Script(RULE),
        predicted_m=way(problem, play),
    )


def preset_of(request: PlanRequest) -> Preset:
    return PRESETS[request.preset, request.kind]


def _forward(progress: Progress, preset: Preset, timesteps: int, mean_reward: float) -> None:
    progress(timesteps, preset.total_timesteps, mean_reward)


def _ppo(lesson: Lesson, _view: StationView, _problem: AlphaProblem) -> Learned:
    return train(lesson)


def _lstm(lesson: Lesson, _view: StationView, _problem: AlphaProblem) -> Learned:
    return train_lstm(lesson)


def _table(lesson: Lesson, view: StationView, problem: AlphaProblem) -> Learned:
    places = (
        2 * problem.model.size
    )  # where the first twin believes all to be, seen from the suspect
    choices = command_list(problem.commands)
    return learn_table(lesson, choices, view.planning.exploration, places)


def _dqn(lesson: Lesson, view: StationView, problem: AlphaProblem) -> Learned:
    return learn_dqn(lesson, command_list(problem.commands), view.planning.exploration)


LEARNERS: dict[str, Learn] = {"ppo": _ppo, "ppo_lstm": _lstm, "qtable": _table, "dqn": _dqn}
