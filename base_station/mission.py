"""The mission: goals as believed, who can still drive, and the learnt policy to orders (pure)."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.autopilots import adapter
from base_station.belief.escalation import PUSH, RECKON, remedy
from base_station.belief.hypotheses import Hypothesis, nominal
from base_station.belief.watch import Watch
from base_station.execution import Orders
from base_station.planning.policy import Commands, act, arrived, beta_observation, to_setpoints
from base_station.planning.requests import Policy, Script
from base_station.planning.scripted.nose_first import Scene, nose_first, without_drive
from hil.scenario import StationView

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

HOME_FRACTION = 0.5  # a rover on its way back goes on to half the goal radius ...
THERE_SLACK_M = 0.05  # ... and 0.3 m of true distance leaves this over the radius of 0.2 m
DRIFT_FRACTION = 0.06  # of the distance reckoned without a GPS axis (twin's speed error)


@dataclass(frozen=True, eq=False)
class Goals:
    """`position_m` [V, 2]; `delivered` latches; `times_s` of delivery, NaN before."""

    position_m: Array
    radius_m: float
    delivered: tuple[bool, ...]
    times_s: tuple[float, ...]
    left: tuple[int, ...] = ()  # indices of those that are left where they are

    @property
    def settled(self) -> tuple[bool, ...]:
        """Who is delivered, or won't be."""
        return tuple(d or v in self.left for v, d in enumerate(self.delivered))

    @classmethod
    def of(cls, view: StationView) -> Self:
        count = len(view.fleet)
        position_m = np.array([[m.goal.north_m, m.goal.east_m] for m in view.fleet])
        radius_m = view.limits.goal_radius_m
        return cls(position_m, radius_m, (False,) * count, (float("nan"),) * count)

    def distance_m(self, state: Array) -> Array:
        """[V] believed distance of vehicles [V, S] from their goals."""
        away = state[:, twin.NORTH : twin.EAST + 1] - self.position_m
        return np.asarray(np.linalg.norm(away, axis=1))

    def newly_reached(self, watch: Watch) -> list[int]:
        """Vehicles that deliver now, by the rule that the plan was learnt with."""
        at_goal = arrived(watch.state[None], self.position_m, self.radius_m, broken(watch))[0]
        return [v for v in np.flatnonzero(at_goal).tolist() if not self.settled[v]]

    def leaving(self, vehicle: int) -> Self:
        return replace(self, left=(*self.left, vehicle))

    def with_delivered(self, vehicle: int, time_s: float) -> Self:
        delivered, times_s = list(self.delivered), list(self.times_s)
        delivered[vehicle], times_s[vehicle] = True, time_s
        return replace(self, delivered=tuple(delivered), times_s=tuple(times_s))

    def there(self, state: Array) -> Flags:
        """[V] close enough for the 0.3 m of true distance that the mission asks for."""
        return self.distance_m(state) <= self.radius_m + THERE_SLACK_M

    def home(self, state: Array, driven: Flags) -> Flags:
        """[V] there, with hysteresis: one that is driving goes on until well inside."""
        limit = np.where(driven, HOME_FRACTION * self.radius_m, self.radius_m)
        return np.asarray(self.distance_m(state) <= limit)

    def only_still_there(self, state: Array) -> Self:
        """Forget deliveries that no longer hold, before the mission is planned again."""
        there = self.there(state)
        return replace(
            self, delivered=tuple(bool(d and t) for d, t in zip(self.delivered, there, strict=True))
        )


def places_m(watch: Watch) -> Array:
    """[V, 2] where the vehicles are believed to be."""
    return watch.state[:, twin.NORTH : twin.EAST + 1].copy()


def belief_of(watch: Watch, view: StationView) -> tuple[Hypothesis, ...]:
    """The one hypothesis that a mission is planned under."""
    return watch.baseline.known[-1:] or (nominal(view.fleet[0].sysid),)


def broken(watch: Watch) -> int | None:
    """Index of the vehicle whose fault is established, if any."""
    known = watch.baseline.known
    return watch.baseline.model.index(known[-1].sysid) if known else None


def can_drive(watch: Watch, view: StationView) -> Flags:
    """[V] vehicles that can go anywhere by themselves."""
    able = np.ones(len(view.fleet), dtype=np.bool_)
    for hypothesis in watch.baseline.known:
        if remedy(hypothesis).startswith(PUSH):
            able[watch.baseline.model.index(hypothesis.sysid)] = view.yaw == "free"
    return able


def must_be_left(hypothesis: Hypothesis, view: StationView) -> bool:
    """Whether the vehicle can neither be driven (its autopilot needs a fix) nor needs a push."""
    member = next(m for m in view.fleet if m.sysid == hypothesis.sysid)
    reckons = remedy(hypothesis).startswith(RECKON)
    return reckons and not adapter(member.autopilot, member.frame).drives_without_fix


def orders(
    policy: Policy,
    watch: Watch,
    goals: Goals,
    elapsed_s: float,
    view: StationView,
    shake: float,
    rng: np.random.Generator,
) -> Orders:
    """What the policy wants of the fleet as it is believed to be now.

    `shake` is the sigma of noise on its action, of the kind it explored with: the mean of a policy
    can be stuck where its samples are not.
    """
    if isinstance(policy, Script):
        return by_rule(watch, goals, view)
    observation = beta_observation(
        watch.state[None],
        np.array([goals.settled]),
        np.array([min(1.0, elapsed_s / view.planning.beta_horizon_s)]),
        watch.baseline.model,
        goals.position_m,
        broken(watch) or 0,
    )
    action = act(policy, observation)
    action = action + shake * rng.standard_normal(action.shape)
    setpoints = to_setpoints(action, Commands.of_view(view))[0]
    driven = np.ones(len(view.fleet), dtype=np.bool_)
    driven[list(goals.left)] = False
    return Orders(setpoints, driven)


def by_rule(watch: Watch, goals: Goals, view: StationView) -> Orders:
    """What the rule for vehicles that turn before they drive wants; who has no drive rolls."""
    model, lost = watch.baseline.model, broken(watch)
    helpless = without_drive(model, watch.baseline.faults(belief_of(watch, view)), lost)
    commands = Commands.of_view(view)
    scene = Scene(model, goals.position_m, commands, goals.radius_m, lost, helpless)
    delivered = np.array([goals.settled])
    setpoints = to_setpoints(nose_first(scene, watch.state[None], delivered), commands)[0]
    driven = ~delivered[0] | (np.abs(setpoints[:, :2]).max(axis=1) > 0.0)
    if lost is not None and helpless:
        driven[lost] = False
    return Orders(setpoints, driven)
