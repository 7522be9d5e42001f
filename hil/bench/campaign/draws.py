"""What a campaign draws by chance: values of overrides, and where everybody starts and goes (pure).

Every draw has a stream of its own, from the seed of the run and the place of the value. So adding a
draw changes no other, and points of a grid that share a layout and a repetition share their draws.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any
from zlib import crc32

import numpy as np

from hil.bench.campaign.file import Layouts
from hil.errors import InputError
from hil.scenario import Arena, Vehicle

MAX_TRIES = 10_000
_LAYOUT_STREAM, _VALUE_STREAM = 0x4C41, 0x5641

Place = tuple[float, float]  # north, east (m)


def _uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _normal(rng: np.random.Generator, mean: float, sigma: float) -> float:
    return float(rng.normal(mean, sigma))


def _choice(rng: np.random.Generator, *values: Any) -> Any:
    return values[int(rng.integers(len(values)))]


DISTRIBUTIONS: dict[str, Callable[..., Any]] = {
    "uniform": _uniform,
    "log_uniform": _log_uniform,
    "normal": _normal,
    "choice": _choice,
}


def drawn(value: Any, seed: int, where: str) -> Any:
    """`value` with every draw in it made; a draw is a map of one key: {uniform: [low, high]}.

    Raises InputError for numbers that the distribution cannot have.
    """
    if isinstance(value, list):
        return [drawn(v, seed, f"{where}.{i}") for i, v in enumerate(value)]
    if not isinstance(value, dict):
        return value
    if len(value) == 1 and (name := next(iter(value))) in DISTRIBUTIONS:
        arguments = value[name]
        rng = np.random.default_rng((seed, crc32(where.encode()), _VALUE_STREAM))
        try:
            return DISTRIBUTIONS[name](rng, *arguments)
        except (TypeError, ValueError, OverflowError):
            raise InputError(
                f"{where} = {{{name}: {arguments}}}: not a draw; write it like "
                "{uniform: [low, high]}, {log_uniform: [low, high]}, {normal: [mean, sigma]} "
                "or {choice: [a, b, c]}"
            ) from None
    return {k: drawn(v, seed, f"{where}.{k}") for k, v in value.items()}


def draw_layout(
    number: int, rules: Layouts, arena: Arena, fleet: Sequence[Vehicle]
) -> list[tuple[Place, Place]]:
    """Start and goal of every vehicle: rejection sampling, a function of `number` and the rules.

    Raises InputError when there seems to be no room.
    """
    rng = np.random.default_rng((number, _LAYOUT_STREAM))
    places: list[tuple[Place, Place]] = []
    for vehicle in fleet:
        margin_m = vehicle.frame.radius_m + rules.wall_m
        for _ in range(MAX_TRIES):
            start, goal = _anywhere(rng, arena, margin_m), _anywhere(rng, arena, margin_m)
            if _fits(start, goal, places, rules):
                places.append((start, goal))
                break
        else:
            raise InputError(
                f"layouts: no room for {vehicle.name} in {MAX_TRIES} tries; lower apart_m or "
                "wall_m, widen travel_m, or make the arena larger"
            )
    return places


def _anywhere(rng: np.random.Generator, arena: Arena, margin_m: float) -> Place:
    north = rng.uniform(arena.north_min_m + margin_m, arena.north_max_m - margin_m)
    east = rng.uniform(arena.east_min_m + margin_m, arena.east_max_m - margin_m)
    return round(float(north), 3), round(float(east), 3)


def _fits(start: Place, goal: Place, taken: Sequence[tuple[Place, Place]], rules: Layouts) -> bool:
    nearest, farthest = rules.travel_m
    return nearest <= math.dist(start, goal) <= farthest and all(
        math.dist(start, s) >= rules.apart_m and math.dist(goal, g) >= rules.apart_m
        for s, g in taken
    )
