"""What every learner is given, and what it gives back."""

from collections.abc import Callable
from dataclasses import dataclass

from base_station.planning.actors import Actor
from base_station.planning.learning.presets import Preset
from base_station.planning.tasks.task import Task


@dataclass(frozen=True, eq=False)
class Lesson:
    """Learn `task` until `target` is met or the preset's time steps are used up.

    `on_progress` hears of time steps and the mean reward of an episode.
    """

    task: Task
    preset: Preset
    seed: int
    target: Callable[[Actor], bool]
    on_progress: Callable[[int, float], None]


@dataclass(frozen=True, eq=False)
class Learned:
    """The outcome of one training; `accepted` is what the target said last.

    `curve` rows are (timesteps, mean episode reward).
    """

    actor: Actor
    accepted: bool
    timesteps: int
    wall_s: float
    curve: tuple[tuple[float, float], ...] = ()
