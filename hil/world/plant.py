"""The plant: the airframe as it really is, a little off its data sheet (pure)."""

from dataclasses import replace

import numpy as np

from hil.airframe import Airframe
from hil.scenario import Plant

_STREAM = 0x504C414E  # keeps these draws apart from others made from the same seed
_CLIP_SIGMA = 3.0


def real_airframe(airframe: Airframe, plant: Plant, seed: int, sysid: int) -> Airframe:
    """One draw of motor gains, mass and rolling resistance around the data sheet.

    A function of seed and system id only: the same vehicle comes out whatever its faults are.
    """
    rng = np.random.default_rng(np.random.SeedSequence((seed, sysid, _STREAM)))
    z = np.clip(rng.standard_normal(2 + len(airframe.motors)), -_CLIP_SIGMA, _CLIP_SIGMA)
    mass = float(1.0 + plant.mass_sigma * z[0])
    rolling = float(1.0 + plant.rolling_sigma * z[1])
    gains = 1.0 + plant.motor_gain_sigma * z[2:]
    return replace(
        airframe,
        mass_kg=airframe.mass_kg * mass,
        yaw_inertia_kgm2=airframe.yaw_inertia_kgm2 * mass,
        rolling_resistance=airframe.rolling_resistance * rolling,
        motors=tuple(
            replace(m, stall_force_n=m.stall_force_n * float(g))
            for m, g in zip(airframe.motors, gains, strict=True)
        ),
    )
