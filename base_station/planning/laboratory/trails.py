"""Where twins go under a plan or a policy, looked at often enough to be drawn (pure)."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.planning.policy import act, to_setpoints
from base_station.planning.requests import OpenLoopPlan, PolicyWeights
from base_station.planning.tasks.alpha import AlphaProblem
from base_station.planning.tasks.beta import BetaProblem
from base_station.twin import EAST, NORTH, advance, report

Array = NDArray[np.float64]

LOOK_S = 0.1  # between points


@dataclass(frozen=True, eq=False)
class Meeting:
    """Two vehicles (by index) come into touch at `place_m` [2] at look `k`, in twin `h`."""

    h: int
    k: int
    pair: tuple[int, int]
    place_m: Array


@dataclass(frozen=True, eq=False)
class Trails:
    """`true_m` and `reported_m` [T, H, V, 2] (north, east), LOOK_S apart; who meets whom."""

    true_m: Array
    reported_m: Array
    meetings: tuple[Meeting, ...]

    @property
    def times_s(self) -> Array:
        return np.asarray(LOOK_S * np.arange(len(self.true_m)), dtype=np.float64)


def of_experiment(problem: AlphaProblem, plan: OpenLoopPlan) -> Trails:
    """Every hypothesis' nominal twin under the plan."""

    def setpoints(k: int, _states: Array) -> Array | None:
        whole = np.repeat(plan.setpoints[k : k + 1], len(problem.start), axis=0)
        return whole if k < len(plan.setpoints) else None

    return _followed(problem, problem.start.copy(), setpoints)


def of_mission(problem: BetaProblem, policy: PolicyWeights) -> Trails:
    """The believed nominal twin under the policy, until all have delivered."""
    delivered = problem.delivered[None].copy()

    def setpoints(k: int, states: Array) -> Array | None:
        delivered[:] |= problem.arrived(states) if k else False
        if k == problem.steps or delivered.all():
            return None
        actions = act(policy, problem.observe(states, delivered, np.array([k])))
        return to_setpoints(actions, problem.commands)

    return _followed(problem, problem.start[None].copy(), setpoints)


def _followed(
    problem: AlphaProblem | BetaProblem,
    states: Array,
    setpoints: Callable[[int, Array], Array | None],
) -> Trails:
    true, reported = [states[..., NORTH : EAST + 1]], [report(states, problem.faults)]
    meetings = list[Meeting]()
    touching = np.zeros((*states.shape[:2], states.shape[1]), dtype=np.bool_)
    k = 0
    while (commanded := setpoints(k, states)) is not None:
        k += 1
        for _ in range(round(problem.period_s / LOOK_S)):
            moved = advance(
                problem.model,
                problem.model.nominal,
                problem.faults,
                states,
                commanded,
                problem.commands.driven,
                LOOK_S,
            )
            states, touched = moved.states, np.triu(moved.impulses_ns) > 0.0
            for h, a, b in zip(*np.nonzero(touched & ~touching), strict=True):
                place = 0.5 * (states[h, a, NORTH : EAST + 1] + states[h, b, NORTH : EAST + 1])
                meetings.append(Meeting(int(h), len(true), (int(a), int(b)), place))
            touching = touched
            true.append(states[..., NORTH : EAST + 1])
            reported.append(report(states, problem.faults))
    return Trails(np.array(true), np.array(reported), tuple(meetings))
