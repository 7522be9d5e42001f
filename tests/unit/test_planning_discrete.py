"""Commands from a list: how they are chosen, and the Q-learners that value them."""

from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import experiment, planning

from base_station.planning.learning.discrete import boltzmann, choose, command_list, sampled
from base_station.planning.learning.lesson import Lesson
from base_station.planning.learning.presets import PRESETS, TUNED_ALPHA
from base_station.planning.learning.qtable import Table, learn_table
from base_station.planning.planner import plan
from base_station.planning.policy import Commands, to_setpoints
from base_station.planning.requests import encode
from base_station.planning.tasks.task import Step


class Corridor:
    """Five cells in a row; only the way to the last one pays, once, after four steps right."""

    environments, observation_size, action_size, progress = 8, 1, 1, 0.0

    def __init__(self) -> None:
        self._place, self._elapsed = np.zeros(8), 0

    def reset(self):
        self._place, self._elapsed = np.zeros(8), 0
        return self._place[:, None].copy()

    def step(self, actions) -> Step:
        self._place = np.clip(self._place + np.sign(actions[:, 0]), 0, 4)
        self._elapsed += 1
        final = self._place[:, None].copy()
        paid = (self._place == 4).astype(float)
        over = self._elapsed == 6
        dones = np.full(8, over)
        return Step(self.reset() if over else final, {"paid": paid}, dones, final)


def test_the_list_has_every_axis_of_every_commanded_vehicle():
    commands = Commands(3, (0, 2), 0.5, yaw_free=False)
    setpoints = to_setpoints(command_list(commands), commands)
    assert setpoints.shape == (9, 3, 3)
    assert not setpoints[0, :, :2].any()
    assert not setpoints[:, 1, :2].any()
    assert sorted(np.linalg.norm(setpoints[..., :2], axis=-1).sum(axis=1)) == [0.0] + [0.5] * 8
    assert len(np.unique(setpoints[..., :2], axis=0)) == 9
    assert len(command_list(replace(commands, yaw_free=True))) == 13


def test_the_boltzmann_policy_prefers_what_is_worth_more():
    """exp(+beta Q); with the sign that the paper prints this fails."""
    shares = boltzmann(np.array([[0.0, 1.0, 2.0]]), 2.0)
    assert shares[0] == pytest.approx(np.exp([-2.0, -1.0, 0.0]) / np.exp([-2.0, -1.0, 0.0]).sum())
    assert boltzmann(np.full((1, 4), 7.0), 2.0)[0] == pytest.approx([0.25] * 4)


def test_sampling_follows_the_shares():
    rng = np.random.default_rng(0)
    index = sampled(np.tile([0.1, 0.0, 0.6, 0.3], (20_000, 1)), rng)
    assert np.bincount(index, minlength=4) / 20_000 == pytest.approx([0.1, 0.0, 0.6, 0.3], abs=0.02)


def test_exploration_fades():
    rng, values = np.random.default_rng(0), np.tile([0.0, 1.0, 0.0, 0.0], (20_000, 1))

    def best(rule, progress):
        return float((choose(values, rule, progress, rng) == 1).mean())

    assert best("greedy", 0.0) == 1.0
    assert best("epsilon", 0.0) == pytest.approx(0.25, abs=0.02)
    assert best("epsilon", 1.0) == pytest.approx(0.95 + 0.05 / 4, abs=0.01)
    assert best("boltzmann", 0.0) < 0.6 < best("boltzmann", 1.0)


def test_a_table_remembers_cells_and_begins_at_random():
    table = Table(3, 2, np.random.default_rng(0))
    first = table.rows(np.array([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0], [0.01, 0.0, -9.0]]))
    assert first.tolist() == [0, 1, 0]  # the third number is not looked at
    assert table.values[0].std() > 0.0
    table.learn(np.array([1, 1]), np.array([2, 2]), np.array([4.0, 6.0]))
    before = table.values[1, 2]
    for _ in range(40):
        table.learn(np.array([1, 1]), np.array([2, 2]), np.array([4.0, 6.0]))
    assert before < 5.0
    assert table.values[1, 2] == pytest.approx(5.0, abs=1e-3)
    assert len(table.rows(np.arange(6000.0).reshape(3000, 2))) == 3000


@pytest.mark.parametrize("rule", ["epsilon", "boltzmann"])
def test_a_table_finds_the_way_to_a_reward_at_the_end(rule):
    preset = replace(TUNED_ALPHA, environments=8, steps=6, total_timesteps=6_000, check_every=10**9)
    lesson = Lesson(Corridor(), preset, 0, lambda _: False, lambda *_: None)
    learned = learn_table(lesson, np.array([[-1.0], [1.0]]), rule, 1)
    rng = np.random.default_rng(0)
    for place in range(4):
        assert learned.actor.act(np.array([[float(place)]]), rng)[0, 0] == 1.0


@pytest.mark.parametrize("name", ["qtable", "dqn", "ppo_lstm"])
def test_other_learners_find_an_experiment_too_and_repeat_to_the_bit(
    rescue_view, name, monkeypatch
):
    """Close by, with a target that a first look can meet: what matters is the whole path."""
    quick = replace(TUNED_ALPHA, environments=16, steps=16, check_every=4, total_timesteps=6_000)
    monkeypatch.setitem(PRESETS, ("tuned", "alpha"), quick)
    diagnosis = rescue_view.diagnosis.model_copy(update={"plan_error": 0.2})
    view = planning(rescue_view.model_copy(update={"diagnosis": diagnosis}), planner=name)
    asked = experiment(view, apart_m=0.8)
    answers = [plan(view, asked, lambda _: None) for _ in range(2)]
    assert answers[0].plan is not None
    assert answers[0].trainings[0].planner == name
    first, second = (encode(replace(a, trainings=())) for a in answers)
    assert first == second
    assert [t.curve for t in answers[0].trainings] == [t.curve for t in answers[1].trainings]


def test_learning_leaves_no_files_behind(rescue_view, monkeypatch, tmp_path):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    quick = replace(TUNED_ALPHA, environments=4, batch_size=128, total_timesteps=128)
    monkeypatch.setitem(PRESETS, ("tuned", "alpha"), quick)
    plan(planning(rescue_view, restarts=0), experiment(rescue_view), lambda _: None)
    assert not list(tmp_path.iterdir())
