"""Q-learning with a table, as in the paper: random at first, made consistent step by step.

The first `seen` numbers of an observation are cut into cells; a row of the table is made when its
cell is first seen. Episodes are learned from end to beginning, so that what a push earns reaches
the way to it in one pass.
"""

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from base_station.planning.learning.discrete import Chooser, Rule, choose
from base_station.planning.learning.lesson import Learned, Lesson
from base_station.planning.tasks.task import Task

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

CELL = 0.2  # of an observation; positions are scaled by 2 m, so 0.4 m
RATE = 0.3
FIRST = 0.01  # spread of the random values that a table begins with


@dataclass(eq=False)
class Table:
    """Values [cells, commands]; `rng` draws those of a cell that is new."""

    commands: int
    seen: int
    rng: np.random.Generator
    _rows: dict[bytes, int] = field(default_factory=dict)
    values: Array = field(init=False)

    def __post_init__(self) -> None:
        self.values = self._fresh(1024)

    def __len__(self) -> int:
        return len(self._rows)

    def rows(self, observations: Array) -> Indices:
        """The rows [C] of observations [C, O]; new ones are made."""
        keys = np.round(observations[:, : self.seen] / CELL).astype(np.int16)
        found = [self._rows.setdefault(key.tobytes(), len(self._rows)) for key in keys]
        while len(self._rows) > len(self.values):
            self.values = np.concatenate([self.values, self._fresh(len(self.values))])
        return np.array(found, dtype=np.int64)

    def __call__(self, observations: Array) -> Array:
        rows = self.rows(observations)
        return self.values[rows]

    def learn(self, rows: Indices, commands: Indices, targets: Array) -> None:
        """Move values towards `targets` [C]; where several mean the same one, to their average."""
        width = self.values.shape[1]
        which, back = np.unique(rows * width + commands, return_inverse=True)
        mean = np.bincount(back, targets) / np.bincount(back)
        self.values.flat[which] += RATE * (mean - self.values.flat[which])

    def _fresh(self, count: int) -> Array:
        return FIRST * self.rng.standard_normal((count, self.commands))


def learn_table(lesson: Lesson, choices: Array, rule: Rule, seen: int) -> Learned:
    """Learn values of commands [N, A] by the first `seen` numbers of an observation."""
    started_s, rng = time.perf_counter(), np.random.default_rng([lesson.seed, 2])
    task, preset = lesson.task, lesson.preset
    table = Table(len(choices), seen, rng)
    actor = Chooser(table, choices, rule)
    curve: list[tuple[float, float]] = []
    timesteps, looked, accepted = 0, 0, False
    rows = table.rows(task.reset())
    while timesteps < preset.total_timesteps and not accepted:
        task.progress = timesteps / preset.total_timesteps
        rows, mean, steps = _episode(task, table, rows, choices, rule, preset.gamma, rng)
        timesteps += steps
        curve.append((float(timesteps), mean))
        lesson.on_progress(timesteps, mean)
        if timesteps - looked >= preset.check_every * preset.rollout:
            looked, accepted = timesteps, lesson.target(actor)
    accepted = accepted or lesson.target(actor)
    took_s = time.perf_counter() - started_s
    return Learned(actor, accepted, timesteps, took_s, tuple(curve))


def _episode(
    task: Task,
    table: Table,
    rows: Indices,
    choices: Array,
    rule: Rule,
    gamma: float,
    rng: np.random.Generator,
) -> tuple[Indices, float, int]:
    """All environments until the first of them is done; the rows after it, return, time steps."""
    told: list[tuple[Indices, Indices, Array, NDArray[np.bool_], Indices]] = []
    total = np.zeros(task.environments)
    while not told or not told[-1][3].any():
        index = choose(table.values[rows], rule, task.progress, rng)
        step = task.step(choices[index])
        after = table.rows(step.final_observations)
        told.append((rows, index, step.rewards, step.dones, after))
        total += step.rewards
        rows = table.rows(step.observations) if step.dones.any() else after
    for before, index, rewards, dones, after in reversed(told):
        ahead = np.where(dones, 0.0, table.values[after].max(axis=1))
        table.learn(before, index, rewards + gamma * ahead)
    return rows, float(total.mean()), len(told) * task.environments
