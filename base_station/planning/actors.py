"""A policy as it stands during a training: what a look at the target plays."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import act
from base_station.planning.requests import PolicyWeights

Array = NDArray[np.float64]


class Actor(Protocol):
    """Plays C episodes at once; a policy with a memory forgets in `begin`."""

    def begin(self, count: int) -> None: ...

    def act(self, observations: Array, rng: np.random.Generator) -> Array:
        """Actions [C, A] for observations [C, O]: the policy's mode in row 0, samples below."""


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A tanh MLP with the spread `exp(log_std)` [A] of its actions."""

    weights: PolicyWeights
    log_std: Array

    def begin(self, count: int) -> None: ...

    def act(self, observations: Array, rng: np.random.Generator) -> Array:
        return spread(act(self.weights, observations), self.log_std, rng)


def spread(mode: Array, log_std: Array, rng: np.random.Generator) -> Array:
    """Modes [C, A], all rows but the first with noise of `exp(log_std)` [A]."""
    noise = np.exp(log_std) * rng.standard_normal(mode.shape)
    noise[0] = 0.0
    return np.asarray(mode + noise, dtype=np.float64)
