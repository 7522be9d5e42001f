"""Learning the mission under one hypothesis: every vehicle to its own goal, by pushing if need be.

Base reward per vehicle and control period: a / (r + 1) + b * delta(r), the paper's. Two readings
of delta: `paper` pays b whenever the vehicle is at its goal, `delivered` once, on arrival. Shaping
adds phi(s') - phi(s) with phi = 0 at the end: that leaves the order of policies as it is.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import (
    Commands,
    act,
    arrived,
    beta_observation,
    to_setpoints,
)
from base_station.planning.requests import PolicyWeights
from base_station.planning.tasks.starts import inside, scattered
from base_station.planning.tasks.task import Episodes, Step
from base_station.twin import (
    EAST,
    HELD_EAST,
    HELD_NORTH,
    NORTH,
    V_EAST,
    V_NORTH,
    FaultArrays,
    FleetModel,
    Parameters,
    advance_in_place,
    perturbed,
)

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Base = Literal["delivered", "paper"]
Play = Callable[[Array, Flags, int], Array]  # states, delivered, control period to actions [E, A]

A = 0.01
B = 100.0
REWARD_SCALE = 0.05  # so that returns are of the order of 10
START_SIGMA_M = 0.03
WALL_COST = 0.2  # per vehicle and control period, after scaling
SHOVED_COST = 0.5  # per metre and period that a delivered broken vehicle is off its goal, scaled
NEAR_START_SHARE = 0.5  # of the episodes at first; fades to none at NEAR_START_UNTIL
NEAR_START_UNTIL = 0.6
SETTLE_STEPS = 2  # control periods in HOLD before success is judged
SLACK_M = 0.05
PUSH_WEIGHT = 1.5  # of the way still to be pushed, and of the nearest rescuer's to get there


@dataclass(frozen=True, eq=False)
class BetaProblem:
    """Bring every vehicle from `start` [V, S] to its goal [V, 2] in `steps` control periods.

    `broken` is the vehicle that the verdict names, None when nothing is wrong. `blocked` [2, 2]
    projects on the directions (north, east) in which it can't drive itself; 0 when it can turn.
    """

    model: FleetModel
    faults: FaultArrays
    start: Array
    delivered: Flags
    goals_m: Array
    commands: Commands
    broken: int | None
    blocked: Array
    radius_m: float
    period_s: float
    steps: int
    base: Base = "delivered"
    shaped: bool = True
    curriculum: bool = True

    def move(self, parameters: Parameters, states: Array, actions: Array, active: Flags) -> Flags:
        """One control period of states [E, V, S] in place; returns wall touches [E, V].

        Environments that are not `active` [E] wait in HOLD.
        """
        walls = np.zeros(states.shape[:2], dtype=np.bool_)
        advance_in_place(
            self.model,
            parameters,
            self.faults,
            states,
            to_setpoints(actions, self.commands),
            active[:, None] & self.commands.driven,
            self.period_s,
            np.empty((len(states), 0, 0)),
            walls,
        )
        return walls

    def observe(self, states: Array, delivered: Flags, elapsed: NDArray[np.int64]) -> Array:
        fraction = np.asarray(elapsed / self.steps)
        suspect = self.broken or 0
        return beta_observation(states, delivered, fraction, self.model, self.goals_m, suspect)

    def arrived(self, states: Array) -> Flags:
        return arrived(states, self.goals_m, self.radius_m, self.broken)

    def potential(self, states: Array, delivered: Flags) -> Array:
        """phi [E]: minus the way still to go (m), and to where the broken one must be pushed."""
        offset = self.goals_m - states[..., NORTH : EAST + 1]
        way = np.where(delivered, 0.0, np.linalg.norm(offset, axis=-1)).sum(axis=1)
        if self.broken is None or self.model.size == 1 or not self.blocked.any():
            return np.asarray(-way)
        push = offset[:, self.broken] @ self.blocked
        length = np.linalg.norm(push, axis=1, keepdims=True)
        position, radius = states[..., NORTH : EAST + 1], self.model.vehicles.radius_m
        behind = push / np.maximum(length, 1e-9)
        helpers = [v for v in self.commands.commanded if v != self.broken]
        reach = radius[self.broken] + radius[helpers]
        spots = position[:, self.broken, None] - behind[:, None] * reach[:, None]
        detour = np.linalg.norm(position[:, helpers] - spots, axis=-1).min(axis=1)
        wanted = ~delivered[:, self.broken] & (length[:, 0] > 0.5 * self.radius_m)
        result: Array = -way - PUSH_WEIGHT * np.where(wanted, detour + length[:, 0], 0.0)
        return result


class BetaTask(Episodes):
    """E environments of the mission, each with physical parameters of its own."""

    def __init__(self, problem: BetaProblem, environments: int, rng: np.random.Generator) -> None:
        super().__init__(environments, problem.commands.size)
        self._problem, self._rng = problem, rng
        self._parameters = perturbed(problem.model, rng, environments)
        self._states = np.empty((environments, *problem.start.shape))
        self._delivered = np.zeros((environments, problem.model.size), dtype=np.bool_)
        self._active = np.ones(environments, dtype=np.bool_)
        self.observation_size = self.reset().shape[1]

    def step(self, actions: Array) -> Step:
        problem = self._problem
        before = problem.potential(self._states, self._delivered)
        walls = problem.move(self._parameters, self._states, actions, self._active)
        self._elapsed += 1
        at_goal = problem.arrived(self._states)
        terms = self._base(at_goal, walls)
        self._delivered |= at_goal
        dones = self._delivered.all(axis=1) | (self._elapsed >= problem.steps)
        if problem.shaped:
            after = problem.potential(self._states, self._delivered)
            terms["shaping"] = np.where(dones, 0.0, after) - before
        return self._stepped(terms, dones)

    def _observe(self) -> Array:
        return self._problem.observe(self._states, self._delivered, self._elapsed)

    def _base(self, at_goal: Flags, walls: Flags) -> dict[str, Array]:
        problem = self._problem
        r = np.linalg.norm(problem.goals_m - self._states[..., NORTH : EAST + 1], axis=-1)
        paid = at_goal & ~self._delivered if problem.base == "delivered" else at_goal
        terms = {
            "progress": REWARD_SCALE * (A / (r + 1.0)).sum(axis=1),
            "arrival": REWARD_SCALE * B * paid.sum(axis=1),
            "wall": -WALL_COST * walls.sum(axis=1),
        }
        if problem.broken is not None:
            off = np.maximum(0.0, r[:, problem.broken] - problem.radius_m)
            terms["shoved"] = -SHOVED_COST * off * self._delivered[:, problem.broken]
        return terms

    def _begin(self, which: Flags) -> None:
        n = int(which.sum())
        states = nominal_starts(self._problem, self._rng, n)
        if self._problem.curriculum and self._problem.broken is not None:
            share = NEAR_START_SHARE * max(0.0, 1.0 - self.progress / NEAR_START_UNTIL)
            near = self._rng.random(n) < share
            states[near] = near_starts(self._problem, self._rng, states[near])
        self._states[which] = states
        self._delivered[which] = self._problem.delivered
        self._elapsed[which] = 0


def nominal_starts(problem: BetaProblem, rng: np.random.Generator, n: int) -> Array:
    """The start, with the uncertainty of where the vehicles are: [N, V, S]."""
    states = np.repeat(problem.start[None], n, axis=0)
    states[..., NORTH : EAST + 1] += START_SIGMA_M * rng.standard_normal((n, problem.model.size, 2))
    return states


def near_starts(problem: BetaProblem, rng: np.random.Generator, states: Array) -> Array:
    """Starts [N, V, S] at rest: the broken one anywhere on its way, the others around it."""
    assert problem.broken is not None
    model, n = problem.model, len(states)
    helpers = [v for v in range(model.size) if v != problem.broken]
    states = states.copy()
    home = states[:, problem.broken, NORTH : EAST + 1]
    share = rng.random((n, 2))  # of the way, north and east apart: it may drive along one first
    place = home + share * (problem.goals_m[problem.broken] - home)
    states[:, problem.broken, NORTH : EAST + 1] = inside(model, place[:, None], [problem.broken])[
        :, 0
    ]
    states[:, helpers, NORTH : EAST + 1] = scattered(model, rng, place, helpers, problem.broken)
    states[..., V_NORTH : V_EAST + 1] = 0.0
    states[..., HELD_NORTH : HELD_EAST + 1] = states[..., NORTH : EAST + 1]
    return states


def success_share(
    problem: BetaProblem, weights: PolicyWeights, rng: np.random.Generator, n: int
) -> float:
    """The share of `n` perturbed rollouts of the deterministic policy that bring all home."""
    return float(brought_home(problem, policy_of(problem, weights), rng, n).mean())


def policy_of(problem: BetaProblem, weights: PolicyWeights) -> Play:
    """A learned policy, played on any number of twins."""

    def play(states: Array, delivered: Flags, k: int) -> Array:
        return act(weights, problem.observe(states, delivered, np.full(len(states), k)))

    return play


def brought_home(problem: BetaProblem, play: Play, rng: np.random.Generator, n: int) -> Flags:
    """Which of `n` perturbed rollouts from nominal starts deliver all and, after rolling out in
    HOLD, leave the broken vehicle at its goal, or where it was settled before, [N]."""
    parameters = perturbed(problem.model, rng, n)
    states = nominal_starts(problem, rng, n)
    delivered = np.tile(problem.delivered, (n, 1))
    for k in range(problem.steps + SETTLE_STEPS):
        active = np.asarray(~delivered.all(axis=1) & (k < problem.steps))
        problem.move(parameters, states, play(states, delivered, k), active)
        if k < problem.steps:
            delivered |= problem.arrived(states)
    done = np.asarray(delivered.all(axis=1))
    if problem.broken is not None:
        at_rest_m = problem.start[problem.broken, NORTH : EAST + 1]
        settled = problem.delivered[problem.broken]
        place_m = at_rest_m if settled else problem.goals_m[problem.broken]
        offset = place_m - states[:, problem.broken, NORTH : EAST + 1]
        done &= np.linalg.norm(offset, axis=1) <= problem.radius_m + SLACK_M
    return done
