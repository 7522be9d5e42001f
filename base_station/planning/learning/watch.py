"""Any stable-baselines3 learner, watched: until the target is met or its steps are used up."""

import time
from collections.abc import Callable
from typing import Any

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from base_station.planning.actors import Actor
from base_station.planning.learning.lesson import Learned, Lesson
from base_station.planning.learning.vec_env import TaskVecEnv


def watched(lesson: Lesson, make: Callable[[], Any], actor_of: Callable[[Any], Actor]) -> Learned:
    """Let the learner that `make` returns learn; its env must be a TaskVecEnv."""
    torch.set_num_threads(1)
    started_s = time.perf_counter()
    learner = make()
    learner.set_logger(Logger(folder=None, output_formats=[]))  # its default leaves files in /tmp
    watch = _Watch(lesson, actor_of)
    learner.learn(lesson.preset.total_timesteps, callback=watch)
    if not watch.accepted:
        watch.look(learner)
    return Learned(
        actor_of(learner),
        watch.accepted,
        learner.num_timesteps,
        time.perf_counter() - started_s,
        tuple(watch.curve),
    )


class _Watch(BaseCallback):  # type: ignore[misc]
    """Once a rollout: reports, fades the curriculum, and stops when the target is met."""

    def __init__(self, lesson: Lesson, actor_of: Callable[[Any], Actor]) -> None:
        super().__init__()
        self.accepted = False
        self.curve: list[tuple[float, float]] = []
        self._lesson, self._actor_of, self._rollouts = lesson, actor_of, 0

    def look(self, learner: Any) -> None:
        self.accepted = self._lesson.target(self._actor_of(learner))

    def _on_rollout_start(self) -> None:
        env: TaskVecEnv = self.model.env
        preset = self._lesson.preset
        env.task.progress = min(1.0, self.num_timesteps / preset.total_timesteps)
        if self.num_timesteps < (self._rollouts + 1) * preset.rollout:
            return  # off-policy learners update more often than that
        self._rollouts += 1
        mean = env.pop_mean_return()
        self.curve.append((float(self.num_timesteps), mean))
        self._lesson.on_progress(self.num_timesteps, mean)
        if self._rollouts % preset.check_every == 0:
            self.look(self.model)

    def _on_step(self) -> bool:
        return not self.accepted
