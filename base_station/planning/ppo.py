"""Proximal policy optimisation: the only place that knows torch and stable-baselines3."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv

from base_station.planning.requests import PolicyWeights
from base_station.planning.tasks import Task

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Preset:
    """How one kind of plan is learned. `batch_size` divides `environments` x `steps`."""

    environments: int
    steps: int
    batch_size: int
    epochs: int
    learning_rate: float
    gamma: float
    gae_lambda: float
    entropy: float
    value_weight: float
    value_clip: float | None
    initial_log_std: float
    total_timesteps: int
    check_every: int  # rollouts between looks at whether the target is met
    hidden: tuple[int, ...] = (64, 64)
    clip: float = 0.2
    max_grad_norm: float = 0.5


PAPER = Preset(
    environments=8,
    steps=128,
    batch_size=256,  # 4 minibatches
    epochs=4,
    learning_rate=2.5e-4,
    gamma=0.99,
    gae_lambda=0.95,
    entropy=0.01,
    value_weight=0.25,  # 0.5 in the paper's loss, which halves the square once more
    value_clip=0.2,
    initial_log_std=0.0,
    total_timesteps=200_000,
    check_every=8,
)
TUNED_ALPHA = Preset(
    environments=32,
    steps=32,
    batch_size=256,
    epochs=8,
    learning_rate=1e-3,
    gamma=0.99,
    gae_lambda=0.95,
    entropy=0.0,
    value_weight=0.5,
    value_clip=None,
    initial_log_std=0.0,
    total_timesteps=40_000,
    check_every=10,  # a plan that only just meets the target would rest on a few centimetres
)
TUNED_BETA = Preset(
    environments=64,
    steps=32,
    batch_size=512,
    epochs=8,
    learning_rate=1e-3,
    gamma=0.99,
    gae_lambda=0.95,
    entropy=0.0,
    value_weight=0.5,
    value_clip=None,
    initial_log_std=-0.5,
    total_timesteps=180_000,
    check_every=4,
)


@dataclass(frozen=True)
class Learned:
    """The outcome of one training; `accepted` is what the target said last."""

    weights: PolicyWeights
    log_std: Array
    accepted: bool
    timesteps: int
    wall_s: float
    curve: tuple[tuple[float, float], ...] = field(default=())


Target = Callable[[PolicyWeights, Array], bool]
Progress = Callable[[int, float], None]


def train(task: Task, preset: Preset, seed: int, target: Target, on_progress: Progress) -> Learned:
    """Train until `target` (weights, log_std [A]) is met or the steps of the preset are used up."""
    torch.set_num_threads(1)
    started = time.perf_counter()
    watch = _Watch(preset, target, on_progress)
    learner = PPO(
        "MlpPolicy",
        TaskVecEnv(task),
        learning_rate=preset.learning_rate,
        n_steps=preset.steps,
        batch_size=preset.batch_size,
        n_epochs=preset.epochs,
        gamma=preset.gamma,
        gae_lambda=preset.gae_lambda,
        clip_range=preset.clip,
        clip_range_vf=preset.value_clip,
        ent_coef=preset.entropy,
        vf_coef=preset.value_weight,
        max_grad_norm=preset.max_grad_norm,
        policy_kwargs={"net_arch": list(preset.hidden), "log_std_init": preset.initial_log_std},
        seed=seed,
        device="cpu",
    )
    learner.learn(preset.total_timesteps, callback=watch)
    if not watch.accepted:
        watch.look(learner)
    return Learned(
        export(learner),
        log_std(learner),
        watch.accepted,
        learner.num_timesteps,
        time.perf_counter() - started,
        tuple(watch.curve),
    )


def export(learner: Any) -> PolicyWeights:
    """The actor as plain arrays."""
    policy = learner.policy
    linear = [m for m in policy.mlp_extractor.policy_net if isinstance(m, torch.nn.Linear)]
    return PolicyWeights(tuple(_arrays(m) for m in [*linear, policy.action_net]))


def log_std(learner: Any) -> Array:
    return np.asarray(learner.policy.log_std.detach().numpy(), dtype=np.float64)


def _arrays(layer: Any) -> tuple[Array, Array]:
    weight = layer.weight.detach().numpy().astype(np.float64)
    return weight, layer.bias.detach().numpy().astype(np.float64)


class _Watch(BaseCallback):  # type: ignore[misc]
    """Between rollouts: reports, fades the curriculum, and stops when the target is met."""

    def __init__(self, preset: Preset, target: Target, on_progress: Progress) -> None:
        super().__init__()
        self.accepted = False
        self.curve: list[tuple[float, float]] = []
        self._preset, self._target, self._on_progress = preset, target, on_progress
        self._rollouts = 0

    def look(self, learner: Any) -> None:
        self.accepted = self._target(export(learner), log_std(learner))

    def _on_rollout_start(self) -> None:
        env: TaskVecEnv = self.model.env
        env.task.progress = min(1.0, self.num_timesteps / self._preset.total_timesteps)
        if self._rollouts == 0:
            return
        mean = env.pop_mean_return()
        self.curve.append((float(self.num_timesteps), mean))
        self._on_progress(self.num_timesteps, mean)
        if self._rollouts % self._preset.check_every == 0:
            self.look(self.model)

    def _on_rollout_end(self) -> None:
        self._rollouts += 1

    def _on_step(self) -> bool:
        return not self.accepted


class TaskVecEnv(VecEnv):  # type: ignore[misc]
    """A Task as stable-baselines3 wants it."""

    render_mode = None

    def __init__(self, task: Task) -> None:
        box = gymnasium.spaces.Box
        super().__init__(
            task.environments,
            box(-np.inf, np.inf, (task.observation_size,), np.float32),
            box(-1.0, 1.0, (task.action_size,), np.float32),
        )
        self.task = task
        self._actions = np.zeros((task.environments, task.action_size))
        self._returns = np.zeros(task.environments)
        self._finished: list[float] = []
        self._last_mean = 0.0

    def pop_mean_return(self) -> float:
        """Mean return of the episodes finished since the last call; the last mean if none was."""
        if self._finished:
            self._last_mean = float(np.mean(self._finished))
            self._finished.clear()
        return self._last_mean

    def reset(self) -> NDArray[np.float32]:
        self._returns[:] = 0.0
        return self.task.reset().astype(np.float32)

    def step_async(self, actions: Array) -> None:
        self._actions = np.asarray(actions, dtype=np.float64)

    def step_wait(self) -> tuple[Any, Any, Any, list[dict[str, Any]]]:
        step = self.task.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        rewards = step.rewards
        self._returns += rewards
        for i in np.flatnonzero(step.dones):
            final = step.final_observations[i].astype(np.float32)
            infos[i] = {"terminal_observation": final, "TimeLimit.truncated": False}
            self._finished.append(float(self._returns[i]))
            self._returns[i] = 0.0
        observations = step.observations.astype(np.float32)
        return observations, rewards.astype(np.float32), step.dones, infos

    def close(self) -> None:
        pass

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self, attr_name)] * len(self._get_indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:  # noqa: ARG002
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        raise NotImplementedError(f"one batch: no {method_name} of a single environment")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:  # noqa: ARG002
        return [False] * len(self._get_indices(indices))
