"""The tasks that are learnt, and learning itself: small, seeded, and against simpler players."""

import math
from dataclasses import replace

import numpy as np
import pytest

from base_station.belief.hypotheses import candidates, nominal
from base_station.planning.actors import Gaussian
from base_station.planning.attempts import derived_seed
from base_station.planning.foresight import way
from base_station.planning.learning.lesson import Lesson
from base_station.planning.learning.ppo import train
from base_station.planning.learning.presets import PRESETS, TUNED_ALPHA
from base_station.planning.learning.vec_env import TaskVecEnv
from base_station.planning.planner import plan
from base_station.planning.policy import Commands, act, arrived, to_setpoints
from base_station.planning.problems import alpha_problem, beta_problem, blocked_directions
from base_station.planning.requests import PlanRequest, PolicyWeights, encode
from base_station.planning.tasks.alpha import AlphaTask
from base_station.planning.tasks.beta import BetaTask, nominal_starts, policy_of, success_share
from base_station.planning.tasks.candidates import best_candidate
from base_station.planning.tasks.objectives import rho_alpha
from base_station.twin import (
    EAST,
    NORTH,
    V_EAST,
    YAW,
    FleetModel,
    advance,
    fault_rows,
    initial_state,
    perturbed,
)

START_M = [[0.0, -2.5], [0.0, 0.0], [0.0, 2.5]]


def request(view, kind, *names, preset="tuned") -> PlanRequest:
    known = {h.name: h for h in candidates(view.fleet[1], view.diagnosis.priors)}
    hypotheses = tuple(known[n] for n in names) or (nominal(1),)
    states = np.stack([initial_state(START_M, [0.0] * 3)] * len(hypotheses))
    shares = (1.0 / len(hypotheses),) * len(hypotheses)
    return PlanRequest(1, kind, 7, preset, hypotheses, shares, states, (False,) * 3)


def alpha(view):
    return alpha_problem(view, request(view, "alpha", "motor_y_off", "gps_east_stuck"))


def beta(view, *names):
    return beta_problem(view, request(view, "beta", *names))


def zero_policy(task) -> PolicyWeights:
    return PolicyWeights(((np.zeros((task.action_size, task.observation_size)), np.zeros(1)),))


@pytest.mark.parametrize("yaw", ["locked", "free"])
@pytest.mark.parametrize("kind", ["alpha", "beta"])
def test_environments_end_and_begin_in_the_same_step(rescue_view, kind, yaw):
    view = rescue_view.model_copy(update={"yaw": yaw})
    rng = np.random.default_rng(0)
    if kind == "alpha":
        problem = replace(alpha(view), steps=3)
        env = TaskVecEnv(AlphaTask(problem, 6, rng))
    else:
        problem = replace(beta(view, "motor_y_off"), steps=3)
        env = TaskVecEnv(BetaTask(problem, 6, rng))
    first = env.reset()
    assert first.shape == (6, *env.observation_space.shape)
    for k in range(1, 7):
        actions = rng.uniform(-1, 1, (6, *env.action_space.shape))
        observations, rewards, dones, infos = env.step(actions)
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        assert np.abs(observations).max() < 10.0
        assert dones.all() == (k % 3 == 0)
        assert all(("terminal_observation" in i) == bool(d) for i, d in zip(infos, dones))  # noqa: B905
        if k == 3:
            assert not np.array_equal(infos[0]["terminal_observation"], observations[0])
            assert infos[0]["TimeLimit.truncated"] is False


def test_rho_is_the_distance_between_the_reports():
    reports = np.zeros((2, 3, 2, 2))
    reports[1, 1, 0] = [3.0, 4.0]
    assert rho_alpha(reports).tolist() == [0.0, 5.0 + 5.0]  # pairs 0-1 and 1-2; 0-2 agree


def test_a_held_suspect_gets_no_set_points(rescue_view):
    assert alpha(rescue_view).commands.commanded == (0, 2)
    free = rescue_view.model_copy(update={"yaw": "free"})
    assert alpha(free).commands.commanded == (0, 1, 2)  # turning it is the better experiment
    assert alpha(free).commands.size == 9


def test_actions_become_set_points():
    commands = Commands(3, (0, 2), 0.5, yaw_free=False)
    setpoints = to_setpoints(np.array([0.5, -1.0, 2.0, 0.0]), commands)
    assert setpoints[:, :2].tolist() == [[0.25, -0.5], [0.0, 0.0], [0.5, 0.0]]
    assert np.isnan(setpoints[:, 2]).all()


def test_a_policy_is_a_tanh_mlp_within_limits():
    weights = PolicyWeights(
        ((np.array([[2.0]]), np.array([1.0])), (np.array([[3.0], [0.1]]), np.zeros(2)))
    )
    hidden = math.tanh(2.0 * 0.5 + 1.0)
    assert act(weights, np.array([[0.5]]))[0] == pytest.approx([1.0, 0.1 * hidden])


@pytest.mark.parametrize("names", [("motor_y_off",), ()])
def test_shaping_adds_up_to_minus_the_first_potential(rescue_view, names):
    """Shaped minus base return is -phi(s0), whatever is done: so the best policy is the same."""
    problem = replace(beta(rescue_view, *names), steps=12)
    plain = replace(problem, shaped=False)
    tasks = [BetaTask(p, 16, np.random.default_rng(4)) for p in (problem, plain)]
    phi = problem.potential(tasks[0]._states, tasks[0]._delivered)
    returns = np.zeros((2, 16))
    rng = np.random.default_rng(5)
    over = np.zeros(16, dtype=np.bool_)
    for _ in range(problem.steps):
        actions = rng.uniform(-1, 1, (16, tasks[0].action_size))
        steps = [task.step(actions) for task in tasks]
        for i, step in enumerate(steps):
            returns[i] += np.where(over, 0.0, step.rewards)
        over |= steps[0].dones
        if over.all():
            break
    assert over.all()
    assert returns[0] - returns[1] == pytest.approx(-phi, abs=1e-9)
    assert phi.min() < -5.0


def test_arrival_is_paid_once_or_always(rescue_view):
    for base, paid in (("delivered", 1), ("paper", 4)):
        problem = replace(beta(rescue_view), base=base, shaped=False, steps=50)
        start = problem.start.copy()
        start[0, NORTH : EAST + 1] = problem.goals_m[0]
        task = BetaTask(replace(problem, start=start), 1, np.random.default_rng(0))
        total = sum(float(task.step(np.zeros((1, 6))).rewards[0]) for _ in range(4))
        assert total == pytest.approx(5.0 * paid, abs=0.05)


def test_a_broken_vehicle_arrives_only_when_it_has_slowed_down():
    goals = np.array(START_M)
    states = initial_state(START_M, [0.0] * 3)[None]
    states[0, :, V_EAST] = 0.6
    assert arrived(states, goals, 0.2, None)[0].tolist() == [True] * 3
    assert arrived(states, goals, 0.2, 1)[0].tolist() == [True, False, True]


def test_what_a_locked_rover_can_not_drive(rescue_view):
    model = FleetModel.from_view(rescue_view)
    known = {h.name: h for h in candidates(rescue_view.fleet[1], rescue_view.diagnosis.priors)}
    start = initial_state(START_M, [0.0] * 3)
    y_off = fault_rows(model, [known["motor_y_off"]])
    assert blocked_directions(model, y_off, start, 1).tolist() == [[0, 0], [0, 1]]
    start[1, YAW] = np.pi / 2
    assert blocked_directions(model, y_off, start, 1) == pytest.approx(np.diag([1.0, 0.0]))
    stuck = fault_rows(model, [known["gps_east_stuck"]])
    assert not blocked_directions(model, stuck, start, 1).any()


def test_learning_repeats_to_the_bit_and_beats_random_play(rescue_view):
    asked = request(rescue_view, "alpha", "motor_y_off", "gps_east_stuck")
    seen = []
    answers = [plan(rescue_view, asked, seen.append) for _ in range(2)]
    first, second = (encode(replace(a, trainings=())) for a in answers)
    assert first == second
    assert seen
    found = answers[0].plan
    assert found is not None
    assert found.held == (1,)
    assert found.predicted_error <= rescue_view.diagnosis.plan_error
    assert found.predicted_reports.shape == (2, 17, 3, 2)
    problem = alpha_problem(rescue_view, asked)
    untrained = AlphaTask(problem, 1, np.random.default_rng(0))
    lazy = best_candidate(problem, Gaussian(zero_policy(untrained), np.full(4, -9.0)), 0)
    assert found.predicted_error < 0.1 * lazy.error


def test_restarts_differ_and_a_missed_target_ends_without_a_plan(rescue_view, monkeypatch):
    assert len({derived_seed(7, k) for k in range(20)}) == 20
    short = replace(TUNED_ALPHA, environments=4, batch_size=128, total_timesteps=128)
    monkeypatch.setitem(PRESETS, ("tuned", "alpha"), short)
    view = rescue_view.model_copy(
        update={
            "diagnosis": rescue_view.diagnosis.model_copy(update={"plan_error": 1e-300}),
            "planning": rescue_view.planning.model_copy(update={"restarts": 1}),
        }
    )
    answer = plan(view, request(view, "alpha", "motor_y_off", "gps_east_stuck"), lambda _: None)
    assert answer.plan is None
    assert [t.accepted for t in answer.trainings] == [False, False]


def test_a_healthy_fleet_learns_to_deliver_where_standing_still_does_not(rescue_view):
    problem = beta(rescue_view)
    asked = request(rescue_view, "beta")
    answer = plan(rescue_view, asked, lambda _: None)
    assert answer.policy is not None
    rng = np.random.default_rng(11)
    assert success_share(problem, answer.policy, rng, 64) >= 0.9
    task = BetaTask(problem, 1, np.random.default_rng(0))
    assert success_share(problem, zero_policy(task), rng, 8) == 0.0
    foreseen_m = answer.predicted_m
    assert foreseen_m is not None
    assert foreseen_m[0] == pytest.approx(asked.states[0, :, NORTH : EAST + 1])
    nearest_m = np.linalg.norm(foreseen_m - problem.goals_m, axis=2).min(axis=0)
    assert (nearest_m <= problem.radius_m).all()
    standing_m = way(problem, policy_of(problem, zero_policy(task)))
    assert len(standing_m) == problem.steps + 1
    assert np.ptp(standing_m, axis=0) == pytest.approx(0.0, abs=0.01)


def test_without_a_push_no_drive_of_its_own_brings_the_broken_rover_home(rescue_view):
    """The scripted 'everyone drives straight to the goal' fails where a push is needed."""
    problem = beta(rescue_view, "motor_y_off")
    rng = np.random.default_rng(0)
    states, parameters = nominal_starts(problem, rng, 8), perturbed(problem.model, rng, 8)
    delivered = np.zeros((8, 3), dtype=np.bool_)
    for _ in range(problem.steps):
        velocity = np.clip(problem.goals_m - states[..., NORTH : EAST + 1], -1.0, 1.0)
        setpoints = np.concatenate([velocity, np.full((8, 3, 1), np.nan)], axis=-1)
        moved = advance(
            problem.model, parameters, problem.faults, states, setpoints, [True] * 3, 0.5
        )
        states = moved.states
        delivered |= problem.arrived(states)
    assert delivered[:, [0, 2]].all()
    assert not delivered[:, 1].any()


def test_an_early_end_of_training_is_the_targets(rescue_view):
    task = AlphaTask(alpha(rescue_view), 4, np.random.default_rng(0))
    small = replace(
        TUNED_ALPHA, environments=4, batch_size=128, check_every=1, total_timesteps=10_000
    )
    learned = train(Lesson(task, small, 0, lambda _: True, lambda *_: None))
    assert learned.accepted
    assert learned.timesteps <= 2 * 4 * small.steps
