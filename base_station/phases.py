"""The phases of a mission, each with just what it needs to know of itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from base_station.belief.hindsight import Hindsight
from base_station.execution import Orders
from base_station.planning.requests import OpenLoopPlan, Policy
from base_station.records import Phase

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Connecting:
    name: Phase = "connect"


@dataclass(frozen=True)
class Arming:
    """`standing_since_s`: armed, and in HOLD; from then on the links are waited for."""

    standing_since_s: float | None = None
    name: Phase = "arm"


@dataclass(frozen=True)
class Probing:
    """[0a]"""

    since_s: float
    name: Phase = "probe"


@dataclass(frozen=True, eq=False)
class Settling:
    """All in HOLD until the fleet is at rest; then [0b], the doubt about a suspect is opened."""

    since_s: float
    hindsight: Hindsight
    name: Phase = "probe"


@dataclass(frozen=True)
class PlanningAlpha:
    """[1] The planner is at work on request `number`, for `twins` (names); the fleet holds."""

    number: int
    twins: tuple[str, ...] = ()
    name: Phase = "plan_alpha"


@dataclass(frozen=True, eq=False)
class Experimenting:
    """[2] `twins` are the names of those that `plan` predicts."""

    plan: OpenLoopPlan
    since_s: float
    twins: tuple[str, ...] = ()
    name: Phase = "experiment"


@dataclass(frozen=True)
class Concluding:
    """The experiment is over: HOLD, and go on judging until the fleet has come to rest."""

    since_s: float
    name: Phase = "experiment"


@dataclass(frozen=True)
class PlanningBeta:
    """[3]"""

    number: int
    name: Phase = "plan_beta"


@dataclass(frozen=True, eq=False)
class OnMission:
    """[4] `orders` stand until the next control period. `clock_s` is the time zero of the policy.

    `places_m` [V, 2] are where the vehicles were at `moved_s`, when one of them last got anywhere;
    `stalls` counts how often nobody did, `shaken_until_s` is until when that is answered by noise.
    """

    policy: Policy
    since_s: float
    clock_s: float
    orders: Orders
    next_control_s: float
    places_m: Array
    moved_s: float
    stalls: int = 0
    shaken_until_s: float = 0.0
    name: Phase = "mission"


@dataclass(frozen=True)
class Returning:
    """Everything is delivered; rovers that left their goals to help go back. `still_since_s`."""

    since_s: float
    still_since_s: float | None = None
    name: Phase = "return"


@dataclass(frozen=True)
class Holding:
    """Stopped for good, for a reason that the result states."""

    reason: str
    name: Phase = "hold"


@dataclass(frozen=True)
class Finished:
    name: Phase = "done"


AnyPhase = (
    Connecting
    | Arming
    | Probing
    | Settling
    | PlanningAlpha
    | Experimenting
    | Concluding
    | PlanningBeta
    | OnMission
    | Returning
    | Holding
    | Finished
)
