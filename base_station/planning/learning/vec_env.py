"""A Task as stable-baselines3 wants it: commands as numbers in [-1, 1], or as one of a list."""

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from base_station.planning.tasks.task import Task

Array = NDArray[np.float64]


class TaskVecEnv(VecEnv):  # type: ignore[misc]
    """`choices` [N, A] are the actions of a discrete task; None: any action."""

    render_mode = None

    def __init__(self, task: Task, choices: Array | None = None) -> None:
        spaces = gymnasium.spaces
        actions: gymnasium.Space[Any] = spaces.Box(-1.0, 1.0, (task.action_size,), np.float32)
        if choices is not None:
            actions = spaces.Discrete(len(choices))
        observations = spaces.Box(-np.inf, np.inf, (task.observation_size,), np.float32)
        super().__init__(task.environments, observations, actions)
        self.task = task
        self._choices = choices
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

    def step_async(self, actions: Any) -> None:
        chosen = actions if self._choices is None else self._choices[actions]
        self._actions = np.asarray(chosen, dtype=np.float64)

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
