"""The tasks as single Gymnasium environments, for learners and people outside this project.

`info["terms"]` holds the parts of the reward by name; they add up to it.
"""

from abc import abstractmethod
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from base_station.planning.tasks.alpha import AlphaProblem, AlphaTask
from base_station.planning.tasks.beta import BetaProblem, BetaTask
from base_station.planning.tasks.task import Task

Observation = NDArray[np.float32]
Action = NDArray[np.float32]
Info = dict[str, dict[str, float]]


class _Single(gymnasium.Env[Observation, Action]):
    """A task of one environment. A seeded reset draws the physical parameters anew."""

    def __init__(self) -> None:
        self._task = self._draw(np.random.default_rng(0))
        observations = (self._task.observation_size,)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, observations, np.float32)
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (self._task.action_size,), np.float32)

    @abstractmethod
    def _draw(self, rng: np.random.Generator) -> Task: ...

    def reset(
        self,
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002
    ) -> tuple[Observation, Info]:
        super().reset(seed=seed)
        if seed is not None:
            self._task = self._draw(self.np_random)
        return self._task.reset()[0].astype(np.float32), {"terms": {}}

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, Info]:
        step = self._task.step(np.asarray(action, dtype=np.float64)[None])
        terms = {name: float(term[0]) for name, term in step.terms.items()}
        observation = step.final_observations[0].astype(np.float32)
        return observation, float(step.rewards[0]), bool(step.dones[0]), False, {"terms": terms}


class AlphaEnv(_Single):
    """The experiment: tell the hypotheses apart."""

    def __init__(self, problem: AlphaProblem) -> None:
        self._problem = problem
        super().__init__()

    def _draw(self, rng: np.random.Generator) -> Task:
        return AlphaTask(self._problem, 1, rng)


class BetaEnv(_Single):
    """The mission under the verdict: everybody to the goal."""

    def __init__(self, problem: BetaProblem) -> None:
        self._problem = problem
        super().__init__()

    def _draw(self, rng: np.random.Generator) -> Task:
        return BetaTask(self._problem, 1, rng)
