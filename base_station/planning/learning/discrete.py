"""Commands from a list, and how one is chosen by its value (policies of the paper's appendix)."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import Commands

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Rule = Literal["greedy", "epsilon", "boltzmann"]

EPSILON = (1.0, 0.05)  # at the beginning and from EXPLORED on
BETA = (1.0, 20.0)  # of the Boltzmann policy, over values scaled to a spread of 1
EXPLORED = 0.6  # of the training


def command_list(commands: Commands) -> Array:
    """Actions [N, A]: all wait, or one vehicle drives along an axis at the speed limit.

    One vehicle at a time keeps the list linear in vehicles: N = 4 V + 1; with free yaw the two
    quarter turns are added. Combinations of all vehicles' would be 5^V.
    """
    width = commands.size // max(1, len(commands.commanded))
    rows = [np.zeros(commands.size)]
    moves = [
        (0, 1.0),
        (0, -1.0),
        (1, 1.0),
        (1, -1.0),
        *([(2, 0.5), (2, -0.5)] if width > 2 else []),
    ]
    for k in range(len(commands.commanded)):
        for part, sign in moves:
            row = np.zeros(commands.size)
            row[k * width + part] = sign
            rows.append(row)
    return np.array(rows)


def choose(values: Array, rule: Rule, progress: float, rng: np.random.Generator) -> Indices:
    """One command [C] by values [C, N] when `progress` of the training is over.

    greedy: argmax Q. epsilon: now and then any. boltzmann: P = exp(+beta Q) / sum: with the minus
    that the paper prints, bad commands would be preferred.
    """
    count, commands = values.shape
    best: Indices = values.argmax(axis=1)
    if rule == "greedy":
        return best
    faded = min(1.0, progress / EXPLORED)
    if rule == "epsilon":
        epsilon = EPSILON[0] + faded * (EPSILON[1] - EPSILON[0])
        anything = rng.integers(0, commands, count)
        return np.where(rng.random(count) < epsilon, anything, best)
    beta = BETA[0] + faded * (BETA[1] - BETA[0])
    return sampled(boltzmann(values, beta), rng)


def boltzmann(values: Array, beta: float) -> Array:
    """Probabilities [C, N] proportional to exp(+beta Q), Q scaled to a spread of 1 per row."""
    spread = np.maximum(np.ptp(values, axis=1, keepdims=True), 1e-9)
    weights = np.exp(beta * (values - values.max(axis=1, keepdims=True)) / spread)
    shares: Array = weights / weights.sum(axis=1, keepdims=True)
    return shares


def sampled(shares: Array, rng: np.random.Generator) -> Indices:
    """One index [C] for each row of probabilities [C, N]."""
    drawn = rng.random((len(shares), 1))
    index: Indices = (shares[:, :-1].cumsum(axis=1) < drawn).sum(axis=1)
    return index


class Values(Protocol):
    def __call__(self, observations: Array) -> Array:
        """Q [C, N] for observations [C, O]."""


@dataclass(frozen=True, eq=False)
class Chooser:
    """An actor by values of `choices` [N, A]: row 0 greedy, the others by the rule as it ends."""

    values: Values
    choices: Array
    rule: Rule

    def begin(self, count: int) -> None: ...

    def act(self, observations: Array, rng: np.random.Generator) -> Array:
        values = self.values(observations)
        index = choose(values, self.rule, 1.0, rng)
        index[0] = values[0].argmax()
        return self.choices[index]
