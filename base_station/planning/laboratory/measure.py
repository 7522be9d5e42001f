"""One job of a reproduction: done, and what came out as a row of plain numbers."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from base_station.belief.hypotheses import candidates, nominal
from base_station.planning.attempts import derived_seed
from base_station.planning.laboratory import layouts
from base_station.planning.laboratory.changes import changed_mission, changed_problem, changed_view
from base_station.planning.laboratory.jobs import Job
from base_station.planning.laboratory.layouts import layout
from base_station.planning.learning.lesson import Lesson
from base_station.planning.learning.presets import Preset
from base_station.planning.policy import to_setpoints
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.requests import OpenLoopPlan, PlanRequest
from base_station.planning.scripted.push import push
from base_station.planning.searches.search import search
from base_station.planning.tasks.alpha import AlphaProblem, AlphaTask, nominal_returns, played
from base_station.planning.tasks.beta import BetaProblem, brought_home
from base_station.planning.tasks.candidates import open_loop_plan
from base_station.planning.tasks.evaluation import plan_errors, predict
from base_station.planning.trying import (
    LEARNERS,
    SEARCHES,
    preset_of,
    taught,
    taught_mission,
)
from base_station.twin import FleetModel, advance_in_place, fault_rows, initial_state
from hil.scenario import StationView

Array = NDArray[np.float64]
Row = dict[str, Any]

APART_M = {"near": 2.5, "far": 4.3, "beta": 2.5}
SAMPLES = 16  # of a policy, when its best plan counts
TIMED_STEPS = 1_000_000  # of one vehicle, for a timing
FEASIBLE_ROLLOUTS = 16
FEASIBLE_SHARE = 0.75  # of the script's perturbed rollouts


def measure(base: StationView, job: Job, restarts: int) -> Row:
    """Do a job. `base` is the paper's scene; `restarts` is what a missed target may cost."""
    started_s, cpu_s = time.perf_counter(), time.process_time()
    if job.study == "cost":
        row = _cost(base, job.number)
    elif job.study == "objective":
        row = _objective(base, job)
    elif job.study == "ladder":
        row = _ladder(base, job)
    elif job.study == "layouts":
        row = _rescue(base, job, restarts)
    elif job.case == "beta":
        row = _mission(base, job, restarts)
    else:
        row = _training(base, job, restarts)
    took_s = {"wall_s": time.perf_counter() - started_s, "cpu_s": time.process_time() - cpu_s}
    return {**row, **took_s}


def row_of_three(view: StationView, job: Job) -> PlanRequest:
    """The paper's situation: three rovers in a row, the second one suspect."""
    known = {h.name: h for h in candidates(view.fleet[1], view.diagnosis.priors)}
    names = ("motor_y_off",) if job.case == "beta" else ("motor_y_off", "gps_east_stuck")
    apart = APART_M[job.case]
    start = initial_state([[0.0, -apart], [0.0, 0.0], [0.0, apart]], [0.0] * 3)
    return PlanRequest(
        number=1,
        kind="beta" if job.case == "beta" else "alpha",
        seed=job.number,
        preset=job.preset,
        hypotheses=tuple(known[n] for n in names),
        posterior=(1.0 / len(names),) * len(names),
        states=np.stack([start] * len(names)),
        delivered=(False,) * 3,
    )


def _training(base: StationView, job: Job, restarts: int) -> Row:
    """The paper's experiment: attempts until one is accepted, and what the last policy does."""
    view = changed_view(base, job.change)
    request = row_of_three(view, job)
    problem = changed_problem(alpha_problem(view, request), job.change)
    judge, preset = alpha_problem(base, request), preset_of(request)
    judge = judge if _alike(judge, problem) else problem

    def attempt(seed: int) -> Row:
        began_s = time.process_time()
        done, found = taught(LEARNERS[job.planner], view, problem, preset, seed, lambda *_: None)
        took_s = time.process_time() - began_s
        actions = played(problem, done.actor, 2, np.random.default_rng([seed, 3]))
        mode, sample = (
            _outcome(judge, problem, s) for s in to_setpoints(actions, problem.commands)
        )
        told = {"error": found.error, "mode": mode, "sample": sample, "curve": done.curve}
        return {
            "accepted": done.accepted,
            "timesteps": done.timesteps,
            "cpu_s": took_s,
            **told,
        }

    return _until_accepted(attempt, job.number, restarts)


def _alike(one: AlphaProblem, other: AlphaProblem) -> bool:
    return one.steps == other.steps and one.commands == other.commands


def _outcome(judge: AlphaProblem, problem: AlphaProblem, setpoints: Array) -> Row:
    return {"error": _error(judge, setpoints), **_distance(problem, setpoints)}


def _mission(base: StationView, job: Job, restarts: int) -> Row:
    request = row_of_three(base, job)
    problem = changed_mission(beta_problem(base, request), job.change)
    return _missions(problem, preset_of(request), job.number, restarts)


def _missions(problem: BetaProblem, preset: Preset, seed: int, restarts: int) -> Row:
    """Trainings of a mission until one is accepted."""

    def attempt(seed: int) -> Row:
        began_s = time.process_time()
        done = taught_mission(problem, preset, seed, lambda *_: None)
        return {
            "accepted": done.accepted,
            "timesteps": done.timesteps,
            "cpu_s": time.process_time() - began_s,
            "curve": done.curve,
        }

    return _until_accepted(attempt, seed, restarts)


def _until_accepted(attempt: Callable[[int], Row], seed: int, restarts: int) -> Row:
    """Attempts with the seeds that the planner would give them."""
    done: list[Row] = []
    while len(done) <= restarts and not (done and done[-1]["accepted"]):
        done.append(attempt(derived_seed(seed, len(done))))
    return {"attempts": done}


def _error(problem: AlphaProblem, setpoints: Array) -> float:
    """The predicted error of set-points [K, V, 3] at the declared percentile."""
    errors = plan_errors(
        problem.model,
        problem.faults,
        problem.start,
        setpoints[None],
        problem.commands.driven,
        problem.period_s,
        problem.limits,
        np.random.default_rng(0),
    )
    return float(errors[0])


def _distance(problem: AlphaProblem, setpoints: Array) -> Row:
    """The paper's D (m) at the end of set-points [K, V, 3] on the nominal twin; by vehicle, too."""
    reports = predict(
        problem.model,
        problem.model.nominal,
        problem.faults,
        problem.start[None],
        setpoints[None],
        problem.commands.driven,
        problem.period_s,
        problem.limits,
    ).reports[0]
    by_vehicle = np.linalg.norm(reports[1, -1] - reports[0, -1], axis=-1)
    return {"d_m": float(np.linalg.norm(by_vehicle)), "by_vehicle_m": by_vehicle.tolist()}


def _objective(base: StationView, job: Job) -> Row:
    """What the best plan earns on the nominal twin when all of the budget is used."""
    planning = base.planning.model_copy(update={"objective": job.change})
    view = base.model_copy(update={"planning": planning})
    request = row_of_three(view, job)
    problem, preset = alpha_problem(view, request), preset_of(request)
    if job.planner in SEARCHES:
        return {"best": _best_found(problem, job, preset.total_timesteps)}
    task = AlphaTask(problem, preset.environments, np.random.default_rng(job.number))
    lesson = Lesson(task, preset, job.number, lambda _: False, lambda *_: None)
    actor = LEARNERS[job.planner](lesson, view, problem).actor
    earned = nominal_returns(
        problem, played(problem, actor, SAMPLES, np.random.default_rng([job.number, 3]))
    )
    return {"best": float(earned.max()), "mode": float(earned[0])}


def _best_found(problem: AlphaProblem, job: Job, budget: int) -> float:
    running = SEARCHES[job.planner](problem, np.random.default_rng(job.number))
    actions, spent, best = next(running), 0, -np.inf
    while spent < budget:
        returns = nominal_returns(problem, actions)
        spent, best = spent + actions.shape[0] * actions.shape[1], max(best, float(returns.max()))
        try:
            actions = running.send(returns)
        except StopIteration:
            break
    return best


def _ladder(base: StationView, job: Job) -> Row:
    """A planner on a random layout of the test set, at the same budget as all others."""
    found = layout(base, job.case, "test", job.number)  # type: ignore[arg-type]
    request = layouts.experiment(found, job.number)
    problem, preset = alpha_problem(found.view, request), preset_of(request)
    target = found.view.diagnosis.plan_error
    if job.planner in SEARCHES:
        done = search(
            problem,
            SEARCHES[job.planner],
            job.number,
            target,
            preset.total_timesteps,
            lambda *_: None,
        )
        assert done.plan is not None
        return {"accepted": done.accepted, "timesteps": done.timesteps, **_worth(done.plan)}
    learned, best = taught(
        LEARNERS[job.planner], found.view, problem, preset, job.number, lambda *_: None
    )
    worth = _worth(open_loop_plan(problem, best))
    return {"accepted": learned.accepted, "timesteps": learned.timesteps, **worth}


def _worth(plan: OpenLoopPlan) -> Row:
    told = plan.prediction
    assert told is not None
    return {
        "error": plan.predicted_error,
        "information_bits": told.information_bits,
        "information_low_bits": told.information_low_bits,
        "impulse_ns": sum(c.impulse_ns for c in told.contacts),
        "cost": told.cost,
    }


def _rescue(base: StationView, job: Job, restarts: int) -> Row:
    """A mission on a random layout of the test set, if it is feasible: if the script can do it."""
    found = layout(base, job.case, "test", job.number)  # type: ignore[arg-type]
    request = layouts.mission(found, job.number, job.preset)
    problem, rng = beta_problem(found.view, request), np.random.default_rng([job.number, 1])
    home = brought_home(problem, push(problem), rng, FEASIBLE_ROLLOUTS)
    scripted = float(home.mean())
    if scripted < FEASIBLE_SHARE:
        return {"scripted": scripted, "attempts": []}
    learned = _missions(problem, preset_of(request), job.number, restarts)
    return {"scripted": scripted, **learned}


def _cost(base: StationView, count: int) -> Row:
    """Time of a step of one vehicle among `count` on a grid, 0.7 m apart, all driving."""
    side = int(np.ceil(np.sqrt(count)))
    places = 0.7 * np.stack(np.divmod(np.arange(count), side), axis=1).astype(np.float64)
    view = layouts.peopled(base, places)
    edge = {"north_min_m": -2.0, "east_min_m": -2.0, "north_max_m": side, "east_max_m": side}
    model = FleetModel.from_view(
        view.model_copy(update={"arena": view.arena.model_copy(update=edge)})
    )
    faults, states = fault_rows(model, (nominal(1),)), initial_state(places, np.zeros(count))[None]
    rng = np.random.default_rng(0)
    setpoints = np.full((count, 3), np.nan)
    setpoints[:, :2] = rng.uniform(-0.5, 0.5, (count, 2))
    duration_s = TIMED_STEPS / count * model.dt_s
    advance_by = partial(
        advance_in_place, model, model.nominal, faults, states, setpoints[None], driven_all(count)
    )
    advance_by(model.dt_s, np.empty((1, 0, 0)), np.zeros((1, count), dtype=np.bool_))  # compile
    began_s = time.process_time()
    advance_by(duration_s, np.empty((1, 0, 0)), np.zeros((1, count), dtype=np.bool_))
    took_s = time.process_time() - began_s
    return {"vehicles": count, "ns_per_step": 1e9 * took_s / (round(duration_s / model.dt_s))}


def driven_all(count: int) -> NDArray[np.bool_]:
    return np.ones((1, count), dtype=np.bool_)
