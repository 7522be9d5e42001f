"""What is learned, seen from the learner: many environments that step together."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Step:
    """One control period of all E environments; those that are done have started anew.

    `observations` [E, O] are of the new episode where `dones` [E]; `final_observations` [E, O]
    always of the old one. `terms` are the named parts of the reward, each [E].
    """

    observations: Array
    terms: dict[str, Array]
    dones: Flags
    final_observations: Array

    @property
    def rewards(self) -> Array:
        """[E]"""
        total: Array = np.sum(list(self.terms.values()), axis=0)
        return total


class Task(Protocol):
    """E environments of a finite horizon. The time is in the observation, so an episode that runs
    out of time ends for good: nothing is bootstrapped from beyond it.

    `progress` is the share of the training that is over; a curriculum fades with it.
    """

    environments: int
    observation_size: int
    action_size: int
    progress: float

    def reset(self) -> Array: ...

    def step(self, actions: Array) -> Step: ...


class Episodes(ABC):
    """What the tasks have in common: episodes that end, and new ones in their places."""

    def __init__(self, environments: int, action_size: int) -> None:
        self.environments, self.action_size, self.progress = environments, action_size, 0.0
        self._elapsed = np.zeros(environments, dtype=np.int64)

    def reset(self) -> Array:
        self._begin(np.ones(self.environments, dtype=np.bool_))
        return self._observe()

    def _stepped(self, terms: dict[str, Array], dones: Flags) -> Step:
        """The end of a control period: those that are done start anew."""
        final = self._observe()
        if not dones.any():
            return Step(final, terms, dones, final)
        self._begin(dones)
        return Step(self._observe(), terms, dones, final)

    @abstractmethod
    def _begin(self, which: Flags) -> None:
        """New episodes where `which` [E]; their time is 0."""

    @abstractmethod
    def _observe(self) -> Array:
        """[E, O]"""
