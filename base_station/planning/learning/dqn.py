"""Q-learning with a network (DQN), by stable-baselines3."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import DQN

from base_station.planning.learning.discrete import Chooser, Rule, choose
from base_station.planning.learning.lesson import Learned, Lesson
from base_station.planning.learning.vec_env import TaskVecEnv
from base_station.planning.learning.watch import watched

Array = NDArray[np.float64]

STARTS = 1_000  # time steps before the first update
UPDATES = 8  # per step of all environments
TARGET_EVERY = 1_000  # time steps between copies of the network into the target network


def learn_dqn(lesson: Lesson, choices: Array, rule: Rule) -> Learned:
    """Learn values of commands [N, A]."""
    preset = lesson.preset

    def make() -> Any:
        return _Ruled(
            rule,
            np.random.default_rng([lesson.seed, 2]),
            policy="MlpPolicy",
            env=TaskVecEnv(lesson.task, choices),
            learning_rate=preset.learning_rate,
            buffer_size=preset.total_timesteps,
            learning_starts=STARTS,
            batch_size=preset.batch_size,
            gamma=preset.gamma,
            train_freq=1,
            gradient_steps=UPDATES,
            target_update_interval=TARGET_EVERY,
            policy_kwargs={"net_arch": list(preset.hidden)},
            seed=lesson.seed,
            device="cpu",
        )

    def actor(learner: Any) -> Chooser:
        return Chooser(lambda seen: _values(learner, seen), choices, rule)

    return watched(lesson, make, actor)


class _Ruled(DQN):  # type: ignore[misc]
    """Chooses by our rule; the built-in one explores in all environments at once or in none."""

    def __init__(self, rule: Rule, rng: np.random.Generator, **settings: Any) -> None:
        self._rule, self._rng = rule, rng
        super().__init__(**settings)

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,  # noqa: ARG002
        deterministic: bool = False,
    ) -> tuple[Any, Any]:
        rule: Rule = "greedy" if deterministic else self._rule
        progress = 1.0 - self._current_progress_remaining
        return choose(_values(self, observation), rule, progress, self._rng), state


def _values(learner: Any, observations: Array) -> Array:
    with torch.no_grad():
        values = learner.q_net(torch.as_tensor(np.asarray(observations, dtype=np.float32)))
    return np.asarray(values.numpy(), dtype=np.float64)
