"""Proximal policy optimisation, by stable-baselines3 (MLP) and sb3-contrib (LSTM)."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO

from base_station.planning.actors import Gaussian, spread
from base_station.planning.learning.lesson import Learned, Lesson
from base_station.planning.learning.presets import Preset
from base_station.planning.learning.vec_env import TaskVecEnv
from base_station.planning.learning.watch import watched
from base_station.planning.requests import PolicyWeights

Array = NDArray[np.float64]


def train(lesson: Lesson) -> Learned:
    """Train an MLP."""

    def make() -> Any:
        env = TaskVecEnv(lesson.task)
        return PPO("MlpPolicy", env, seed=lesson.seed, **settings(lesson.preset))

    return watched(lesson, make, gaussian)


def train_lstm(lesson: Lesson) -> Learned:
    """Train an LSTM with an MLP behind it, in actor and critic."""

    def make() -> Any:
        parts = settings(lesson.preset)
        parts["policy_kwargs"]["lstm_hidden_size"] = lesson.preset.lstm_units
        return RecurrentPPO("MlpLstmPolicy", TaskVecEnv(lesson.task), seed=lesson.seed, **parts)

    return watched(lesson, make, Recurrent)


def settings(preset: Preset) -> dict[str, Any]:
    """The preset in the words of stable-baselines3."""
    return {
        "learning_rate": preset.learning_rate,
        "n_steps": preset.steps,
        "batch_size": preset.batch_size,
        "n_epochs": preset.epochs,
        "gamma": preset.gamma,
        "gae_lambda": preset.gae_lambda,
        "clip_range": preset.clip,
        "clip_range_vf": preset.value_clip,
        "ent_coef": preset.entropy,
        "vf_coef": preset.value_weight,
        "max_grad_norm": preset.max_grad_norm,
        "policy_kwargs": {
            "net_arch": list(preset.hidden),
            "log_std_init": preset.initial_log_std,
        },
        "device": "cpu",
    }


def gaussian(learner: Any) -> Gaussian:
    """The actor as plain arrays."""
    policy = learner.policy
    linear = [m for m in policy.mlp_extractor.policy_net if isinstance(m, torch.nn.Linear)]
    layers = tuple(_arrays(m) for m in [*linear, policy.action_net])
    return Gaussian(PolicyWeights(layers), log_std(learner))


def log_std(learner: Any) -> Array:
    return np.asarray(learner.policy.log_std.detach().numpy(), dtype=np.float64)


def _arrays(layer: Any) -> tuple[Array, Array]:
    weight = layer.weight.detach().numpy().astype(np.float64)
    return weight, layer.bias.detach().numpy().astype(np.float64)


@dataclass(eq=False)
class Recurrent:
    """The LSTM policy as it stands. It never leaves the planner: an experiment is sent as
    set-points, so nobody needs it as arrays."""

    learner: Any
    _memory: Any = field(default=None, init=False)
    _first: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, np.bool_), init=False)

    def begin(self, count: int) -> None:
        self._memory, self._first = None, np.ones(count, dtype=np.bool_)

    def act(self, observations: Array, rng: np.random.Generator) -> Array:
        mode, self._memory = self.learner.policy.predict(
            observations.astype(np.float32),
            state=self._memory,
            episode_start=self._first,
            deterministic=True,
        )
        self._first = np.zeros(len(observations), dtype=np.bool_)
        return spread(mode.astype(np.float64), log_std(self.learner), rng)
