"""Random situations in four tiers, from a seed and a number: the same ones wherever they are drawn.

near: helpers within 3 m of the suspect. far: nobody within 4 m. obstructed: the suspect close to a
wall, or a healthy rover between it and the next one. cluttered: 6 to 10 vehicles. The sets `tuning`
and `test` have no layout in common; what is tuned must never look at `test`.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from base_station.belief.hypotheses import candidates
from base_station.planning.requests import PlanRequest
from base_station.twin import initial_state
from hil.scenario import StationView

Array = NDArray[np.float64]
Tier = Literal["near", "far", "obstructed", "cluttered"]
Set = Literal["tuning", "test"]

TIERS: tuple[Tier, ...] = ("near", "far", "obstructed", "cluttered")
SETS: tuple[Set, ...] = ("tuning", "test")
COUNT = 100  # of layouts per tier and set
ROOM_M = 0.5  # between rims, at the start and at the goals
PUSHER_M = 0.9  # between a suspect's rim and the wall, so that somebody fits behind it
NEAR_M, FAR_M = (1.1, 3.0), 4.0  # between centres
AT_WALL_M = 0.15  # rim to wall, in the obstructed tier
TRIES = 1000
FIRST_PORT = 20_000  # no layout is ever connected to
FAULTS = ("motor_x_off", "motor_y_off")  # by dead axis


@dataclass(frozen=True, eq=False)
class Layout:
    """`view` with the fleet and its goals; `starts_m` [V, 2]; `suspect` is an index; `fault` names
    the hypothesis that is true."""

    tier: Tier
    view: StationView
    starts_m: Array
    suspect: int
    fault: str


def layout(base: StationView, tier: Tier, which: Set, number: int) -> Layout:
    """Layout `number` of a set, in the arena of `base` and with copies of its first vehicle.

    Raises ValueError when the arena has no room for it.
    """
    rng = np.random.default_rng([TIERS.index(tier), SETS.index(which), number])
    for _ in range(TRIES):
        count = int(rng.integers(6, 11)) if tier == "cluttered" else 3
        dead = int(rng.integers(2))  # axis: 0 north, 1 east
        starts = _starts(base, tier, count, dead, rng)
        goals = _places(base, count, PUSHER_M, rng)
        if starts is not None and goals is not None:
            return Layout(tier, peopled(base, goals), starts, 0, FAULTS[dead])
    raise ValueError(f"the arena has no room for a layout of tier {tier!r}; make it larger")


def mission(found: Layout, seed: int, preset: str = "tuned") -> PlanRequest:
    """Plan beta from the start, under what is true."""
    return _request(found, "beta", (found.fault,), seed, preset)


def experiment(found: Layout, seed: int, preset: str = "tuned") -> PlanRequest:
    """Plan alpha: is it the motors, or the GPS along the axis that they drive?"""
    other = "gps_east_stuck" if found.fault == "motor_y_off" else "gps_north_stuck"
    return _request(found, "alpha", (found.fault, other), seed, preset)


def _request(
    found: Layout, kind: Literal["alpha", "beta"], names: tuple[str, ...], seed: int, preset: str
) -> PlanRequest:
    suspect = found.view.fleet[found.suspect]
    known = {h.name: h for h in candidates(suspect, found.view.diagnosis.priors)}
    count = len(found.view.fleet)
    start = initial_state(found.starts_m, np.zeros(count))
    return PlanRequest(
        number=1,
        kind=kind,
        seed=seed,
        preset=preset,
        hypotheses=tuple(known[name] for name in names),
        posterior=(1.0 / len(names),) * len(names),
        states=np.stack([start] * len(names)),
        delivered=(False,) * count,
    )


def _starts(
    base: StationView, tier: Tier, count: int, dead: int, rng: np.random.Generator
) -> Array | None:
    """Places [V, 2] that suit the tier, the suspect's first; None: draw again."""
    if tier == "obstructed":
        return _obstructed(base, dead, rng)
    places = _places(base, count, PUSHER_M, rng)
    if places is None:
        return None
    nearest = np.linalg.norm(places[1:] - places[0], axis=1).min()
    suits = nearest >= FAR_M if tier == "far" else NEAR_M[0] <= nearest <= NEAR_M[1]
    return places if suits else None


def _obstructed(base: StationView, dead: int, rng: np.random.Generator) -> Array | None:
    """The suspect at a wall along which it must be pushed (across, nobody fits behind it), or the
    second vehicle between it and the third."""
    places = _places(base, 3, PUSHER_M, rng)
    if places is None:
        return None
    low, high = _inner(base, 0.0)
    if rng.random() < 0.5:
        axis, side = 1 - dead, int(rng.integers(2))
        places[0, axis] = (low[axis] + AT_WALL_M, high[axis] - AT_WALL_M)[side]
    else:
        places[1] = places[0] + rng.uniform(0.35, 0.65) * (places[2] - places[0])
    return places if _apart(base, places) else None


def _places(
    base: StationView, count: int, margin_m: float, rng: np.random.Generator
) -> Array | None:
    low, high = _inner(base, margin_m)
    if (low > high).any():
        return None
    places = rng.uniform(low, high, (count, 2))
    return places if _apart(base, places) else None


def _apart(base: StationView, places: Array) -> bool:
    reach = 2.0 * base.fleet[0].frame.radius_m + ROOM_M
    distance = np.linalg.norm(places[:, None] - places[None], axis=-1)
    return bool((distance[~np.eye(len(places), dtype=np.bool_)] >= reach).all())


def _inner(base: StationView, margin_m: float) -> tuple[Array, Array]:
    """Lowest and highest centre (north, east) that leaves a margin to the walls."""
    arena, edge = base.arena, margin_m + base.fleet[0].frame.radius_m
    low = np.array([arena.north_min_m, arena.east_min_m]) + edge
    return low, np.array([arena.north_max_m, arena.east_max_m]) - edge


def peopled(base: StationView, goals: Array) -> StationView:
    """The view with as many copies of its first vehicle as there are goals [V, 2]."""
    first = base.fleet[0]
    fleet = tuple(
        first.model_copy(
            update={
                "name": f"rover_{k + 1}",
                "sysid": k + 1,
                "mavlink_port": FIRST_PORT + k,
                "connection": None,
                "goal": first.goal.model_copy(
                    update={"north_m": float(goal[0]), "east_m": float(goal[1])}
                ),
            }
        )
        for k, goal in enumerate(goals)
    )
    return base.model_copy(update={"fleet": fleet})
