"""What an experiment is rewarded for, as named terms per control period; a problem carries one."""

from dataclasses import dataclass
from itertools import combinations
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from base_station.planning.tasks.evaluation import pair_squares, rolling_work_j
from base_station.twin import FleetModel

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Terms = dict[str, Array]

WALL_COST = 1.0  # per vehicle, twin and control period
GAIN = 10.0  # for all there is to know
CONTACT_COST = 0.01  # per N s between vehicles
TIME_COST = 0.1  # per second and share of the question still open
ENERGY_COST = 0.002  # per J against rolling resistance


@dataclass(frozen=True, eq=False)
class Moment:
    """The end of a control period in E environments x H twins.

    `states` [E, H, V, S], `reports` [E, H, V, 2] (m), `walls` [E, H, V] touched meanwhile,
    `impulses_ns` [E, H, V, V] of contacts, or [E, H, 0, 0] for an objective without `contacts`.
    """

    model: FleetModel
    period_s: float
    states: Array
    reports: Array
    walls: Flags
    impulses_ns: Array


class Objective(Protocol):
    """`memory` [E, M] is what it must remember of the episode; `own_state`: does a twin go on from
    its own state (the paper's workflow) or from the first twin's (the formula as printed)?"""

    @property
    def own_state(self) -> bool: ...

    @property
    def contacts(self) -> bool: ...

    def begin(self, reports: Array) -> Array:
        """The memory of episodes that start with `reports` [E, H, V, 2]."""

    def terms(self, moment: Moment, memory: Array) -> Terms:
        """Named rewards, each [E]; brings `memory` up to date in place."""

    def seen(self, memory: Array) -> Array:
        """[E, O]: what of it a learner must see, so that its future rewards depend on nothing else
        (on the displacement so far they do, a little, through the spread that grows with it)."""


@dataclass(frozen=True)
class PaperDistance:
    """The paper's rho: the distance between the reports that the twins predict."""

    own_state: bool = True
    contacts: bool = False

    def begin(self, reports: Array) -> Array:
        return np.empty((len(reports), 0))

    def terms(self, moment: Moment, memory: Array) -> Terms:  # noqa: ARG002
        distance = rho_alpha(moment.reports) * moment.period_s
        return {"distance": distance, "wall": wall_term(moment)}

    def seen(self, memory: Array) -> Array:
        return memory


@dataclass(frozen=True)
class Information:
    """Expected information gain at the declared noise, less priced contact, time and energy.

    `weights` [H] is the posterior before the experiment. Memory: first reports, then d'^2 by pair.
    """

    weights: tuple[float, ...]
    own_state: bool = True
    contacts: bool = True

    def begin(self, reports: Array) -> Array:
        first = reports.reshape(len(reports), -1)
        return np.concatenate([first, np.zeros((len(reports), self._pairs))], axis=1)

    def terms(self, moment: Moment, memory: Array) -> Terms:
        first = memory[:, : -self._pairs].reshape(moment.reports.shape)
        squares = memory[:, -self._pairs :]
        before = known_share(squares, self.weights)
        moved = np.linalg.norm(moment.reports - first, axis=-1, keepdims=True)
        squares += pair_squares(moment.reports, moved)
        after = known_share(squares, self.weights)
        work = rolling_work_j(moment.model, moment.states, moment.period_s)
        impulse = 0.5 * moment.impulses_ns.sum(axis=(-2, -1))
        return {
            "information": GAIN * (after - before),
            "contact": -CONTACT_COST * self._expected(impulse),
            "time": -TIME_COST * moment.period_s * (1.0 - after),
            "energy": -ENERGY_COST * self._expected(work),
            "wall": wall_term(moment),
        }

    def seen(self, memory: Array) -> Array:
        return np.tanh(0.25 * np.sqrt(memory[:, -self._pairs :]))

    @property
    def _pairs(self) -> int:
        return len(self.weights) * (len(self.weights) - 1) // 2

    def _expected(self, costs: Array) -> Array:
        """[E, H] to [E]."""
        mean: Array = costs @ np.asarray(self.weights)
        return mean


def rho_alpha(reports: Array) -> Array:
    """The paper's reward: reports [E, H, V, 2] to the summed disagreement of all pairs, [E] (m)."""
    total = np.zeros(len(reports))
    for a, b in combinations(range(reports.shape[1]), 2):
        total += np.linalg.norm((reports[:, a] - reports[:, b]).reshape(len(reports), -1), axis=1)
    return total


def known_share(squares: Array, weights: tuple[float, ...]) -> Array:
    """The share of the question that reports answer on average, [E] in [0, 1].

    `squares` [E, P] is d'^2 of each pair. The mutual information of hypothesis and reports, over
    the entropy of `weights` [H]; a lower bound for more than one d' (Kolchinsky and Tracey 2017:
    a mixture of normal distributions by its Bhattacharyya distances d'^2 / 8).
    """
    prior = np.asarray(weights)
    alike = np.ones((len(squares), len(prior), len(prior)))
    for k, (a, b) in enumerate(combinations(range(len(prior)), 2)):
        alike[:, a, b] = alike[:, b, a] = np.exp(-squares[:, k] / 8.0)
    information = -np.log(alike @ prior) @ prior
    share: Array = information / entropy(weights)
    return share


def entropy(weights: tuple[float, ...]) -> float:
    """Of a posterior [H], in nats."""
    prior = np.asarray(weights)
    return float(-(np.log(prior) @ prior))


def wall_term(moment: Moment) -> Array:
    touched: Array = -WALL_COST * moment.walls.sum(axis=(1, 2))
    return touched
