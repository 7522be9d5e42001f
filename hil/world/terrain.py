"""Wind, slope and patches of other friction, as forces and factors (pure).

A rover's drag in still air is part of its rolling resistance; wind adds to a rover only what it
has beyond that, so that without wind there is no such force at all.
"""

import math
from dataclasses import dataclass

from hil.airframe import GRAVITY_MPS2, Airframe
from hil.scenario import Patch, Slope, Terrain, Wind, in_effect

AIR_DENSITY_KGPM3 = 1.225  # ISA, sea level

Vector = tuple[float, float, float]
_CALM = Wind()


@dataclass(frozen=True)
class Ambient:
    """What a terrain is at one moment."""

    wind: Wind
    slope: Slope
    patches: tuple[Patch, ...]


def ambient(terrain: Terrain, time_s: float) -> Ambient:
    """What holds at a world time: calm and level where nothing does."""
    return Ambient(
        in_effect(terrain.wind, time_s) or Wind(),
        in_effect(terrain.slope, time_s) or Slope(),
        tuple(p for p in terrain.patches if p.holds(time_s)),
    )


def change_times_s(terrain: Terrain) -> list[float]:
    """When `ambient` may become another one, in order."""
    periods = (*terrain.wind, *terrain.slope, *terrain.patches)
    ends = {p.until_s for p in periods if p.until_s is not None}
    return sorted({p.from_s for p in periods} | ends)


def friction_factor(terrain: Ambient, north_m: float, east_m: float) -> float:
    """What multiplies rolling resistance and grip at a place."""
    return next((p.friction for p in terrain.patches if _inside(p, north_m, east_m)), 1.0)


def slope_force_n(slope: Slope, mass_kg: float) -> tuple[float, float]:
    """North and east force (N) on what stands on the slope: m g sin(slope), downhill."""
    if slope.north == 0.0 and slope.east == 0.0:
        return 0.0, 0.0
    weight_n = mass_kg * GRAVITY_MPS2
    along_n = weight_n / math.hypot(1.0, slope.north, slope.east)
    return -along_n * slope.north, -along_n * slope.east


def drag_n(frame: Airframe, wind: Wind, velocity_mps: Vector) -> Vector:
    """Drag (N, NED) of a body that moves in wind: rho / 2 CdA |v| v of the air past it."""
    air = (
        wind.north_mps - velocity_mps[0],
        wind.east_mps - velocity_mps[1],
        -velocity_mps[2],
    )
    k = 0.5 * AIR_DENSITY_KGPM3 * frame.drag_area_m2 * math.hypot(*air)
    return k * air[0], k * air[1], k * air[2]


def wind_force_n(frame: Airframe, wind: Wind, velocity_mps: Vector) -> Vector:
    """What wind adds (N, NED) to the drag in still air."""
    if wind.north_mps == 0.0 and wind.east_mps == 0.0:
        return 0.0, 0.0, 0.0
    windy, still = drag_n(frame, wind, velocity_mps), drag_n(frame, _CALM, velocity_mps)
    return windy[0] - still[0], windy[1] - still[1], windy[2] - still[2]


def _inside(patch: Patch, north_m: float, east_m: float) -> bool:
    return (
        patch.north_min_m <= north_m <= patch.north_max_m
        and patch.east_min_m <= east_m <= patch.east_max_m
    )
