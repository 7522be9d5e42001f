"""What is learned, seen from the learner: many environments that step together."""

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
