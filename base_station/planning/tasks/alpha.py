"""Learning to tell hypotheses apart: twins under the same commands, rewarded for disagreeing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.actors import Actor
from base_station.planning.policy import Commands, to_setpoints
from base_station.planning.tasks.limits import PRICE, Contacts, Limits
from base_station.planning.tasks.motion import move
from base_station.planning.tasks.objectives import Moment, Objective, Terms
from base_station.planning.tasks.starts import scattered
from base_station.planning.tasks.task import Episodes, Step
from base_station.twin import (
    EAST,
    HELD_EAST,
    HELD_NORTH,
    NORTH,
    V_EAST,
    V_NORTH,
    YAW,
    FaultArrays,
    FleetModel,
    Parameters,
    perturbed,
    report,
)
from hil.scenario import Uncertainty

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

START_SIGMA_M = 0.03
NEAR_START_SHARE = 0.5
SCALE_M = 2.0


@dataclass(frozen=True, eq=False)
class AlphaProblem:
    """Tell the hypotheses in `faults` apart from states `start` [H, V, S] in `steps` periods.

    `objective` says what that is worth, `limits` what it must not do;
    `weights` [H] is the posterior before the experiment.
    """

    model: FleetModel
    faults: FaultArrays
    start: Array
    commands: Commands
    suspect: int
    period_s: float
    steps: int
    objective: Objective
    limits: Limits
    weights: tuple[float, ...]
    declared: Uncertainty  # of the twins to learn with; plans are judged by the model's own
    start_sigma_m: float = START_SIGMA_M
    near_starts: float = NEAR_START_SHARE  # of the episodes at first; fades to none half-way

    def move(self, parameters: Parameters, states: Array, memory: Array, setpoints: Array) -> Terms:
        """One control period of states [E, H, V, S] and memory [E, M] in place: named rewards.

        `setpoints` [E, V, 3].
        """
        hypotheses, count = states.shape[1:3]
        batch = states.reshape(-1, *states.shape[2:])
        walls = np.zeros(batch.shape[:2], dtype=np.bool_)
        impulses = self.objective.contacts or self.limits.of_contacts
        met = Contacts.none(len(batch), count, impulses, self.limits.of_speed)
        commanded = np.repeat(setpoints, hypotheses, axis=0)
        driven = np.tile(self.commands.driven, (len(batch), 1))
        move(
            self.model, parameters, self.faults, batch, commanded, driven, self.period_s, walls, met
        )
        pairs = met.impulses_ns.shape[1]
        moment = Moment(
            self.model,
            self.period_s,
            states,
            self.reports(states),
            (walls & ~self.limits.may_brush).reshape(states.shape[:3]),
            met.impulses_ns.reshape(*states.shape[:2], pairs, pairs),
        )
        terms = self.objective.terms(moment, memory)
        if self.limits.any:
            breaches = self.limits.breaches(met, batch, self.model)
            terms["limit"] = -PRICE * breaches.reshape(states.shape[:2]).sum(axis=1)
        if not self.objective.own_state:
            states[:] = states[:, :1]
        return terms

    def reports(self, states: Array) -> Array:
        """[E, H, V, 2] of states [E, H, V, S]."""
        flat = report(states.reshape(-1, *states.shape[2:]), self.faults)
        return flat.reshape(*states.shape[:3], 2)

    def observe(self, states: Array, memory: Array, elapsed: NDArray[np.int64]) -> Array:
        """[E, O]: where each twin believes all to be, how their reports differ, what the objective
        remembers, and the time."""
        reports = self.reports(states)
        origin = self.start[0, self.suspect, NORTH : EAST + 1]
        blocks: list[Array] = [
            (states[..., NORTH : EAST + 1] - origin) / SCALE_M,
            states[..., V_NORTH : V_EAST + 1] / self.model.vehicles.speed_limit_mps[:, None],
            reports[:, 1:] - reports[:, :1],
            np.asarray(elapsed / self.steps),
            self.objective.seen(memory),
        ]
        if not self.model.vehicles.yaw_locked:
            blocks += [np.cos(states[..., YAW]), np.sin(states[..., YAW])]
        return np.concatenate([block.reshape(len(states), -1) for block in blocks], axis=1)


def played(problem: AlphaProblem, actor: Actor, count: int, rng: np.random.Generator) -> Array:
    """`count` episodes on the nominal twin, [C, K, A]: the actor's mode first, then samples."""
    states = np.repeat(problem.start[None], count, axis=0)
    memory = problem.objective.begin(problem.reports(states))
    actions = np.empty((count, problem.steps, problem.commands.size))
    actor.begin(count)
    for k in range(problem.steps):
        seen = problem.observe(states, memory, np.full(count, k))
        actions[:, k] = actor.act(seen, rng)
        setpoints = to_setpoints(actions[:, k], problem.commands)
        problem.move(problem.model.nominal, states, memory, setpoints)
    return actions


def nominal_returns(problem: AlphaProblem, actions: Array) -> Array:
    """What action sequences [C, K, A] earn on the nominal twin, [C]."""
    states = np.repeat(problem.start[None], len(actions), axis=0)
    memory = problem.objective.begin(problem.reports(states))
    setpoints, total = to_setpoints(actions, problem.commands), np.zeros(len(actions))
    for k in range(problem.steps):
        terms = problem.move(problem.model.nominal, states, memory, setpoints[:, k])
        total += sum(terms.values())
    return total


class AlphaTask(Episodes):
    """E environments x H twins, each environment with physical parameters of its own."""

    def __init__(self, problem: AlphaProblem, environments: int, rng: np.random.Generator) -> None:
        super().__init__(environments, problem.commands.size)
        self._problem, self._rng = problem, rng
        self._parameters = perturbed(problem.model, rng, environments, problem.declared)
        self._states = np.zeros((environments, *problem.start.shape))
        self._memory = problem.objective.begin(problem.reports(self._states))
        self.observation_size = self.reset().shape[1]

    def step(self, actions: Array) -> Step:
        problem = self._problem
        setpoints = to_setpoints(actions, problem.commands)
        terms = problem.move(self._parameters, self._states, self._memory, setpoints)
        self._elapsed += 1
        return self._stepped(terms, self._elapsed >= problem.steps)

    def _observe(self) -> Array:
        return self._problem.observe(self._states, self._memory, self._elapsed)

    def _begin(self, which: Flags) -> None:
        """New episodes; some of them with the commanded vehicles anywhere around the suspect."""
        problem, n = self._problem, int(which.sum())
        states = np.repeat(problem.start[None], n, axis=0)
        noise = problem.start_sigma_m * self._rng.standard_normal((n, 1, problem.model.size, 2))
        states[..., NORTH : EAST + 1] += noise
        states[..., HELD_NORTH : HELD_EAST + 1] += noise
        near = self._rng.random(n) < problem.near_starts * max(0.0, 1.0 - 2.0 * self.progress)
        others = [v for v in problem.commands.commanded if v != problem.suspect]
        centre = states[near, 0, problem.suspect, NORTH : EAST + 1]
        places = scattered(problem.model, self._rng, centre, others, problem.suspect)
        for v, place in zip(others, places.swapaxes(0, 1), strict=True):
            states[near, :, v, NORTH : EAST + 1] = place[:, None]
            states[near, :, v, HELD_NORTH : HELD_EAST + 1] = place[:, None]
        self._states[which] = states
        self._memory[which] = problem.objective.begin(problem.reports(states))
        self._elapsed[which] = 0
