"""How far a fix was from what the estimator expected, as EKF_STATUS_REPORT tells it (pure)."""

import math
from dataclasses import dataclass

from hil.scenario import Sensors as Noise
from sim_vehicles.estimator import Estimate
from sim_vehicles.sensors import GpsFix

GATE_SIGMAS = 5.0  # ArduPilot's EK3_POS_I_GATE and EK3_VEL_I_GATE


@dataclass(frozen=True, slots=True)
class Innovation:
    """Each over its gate: 1 is where a fix would be doubted."""

    velocity: float = 0.0
    position: float = 0.0
    height: float = 0.0


def innovation(fix: GpsFix, before: Estimate, noise: Noise) -> Innovation:
    """`before` is the estimate that the fix has not yet corrected. Noise is the fix's own."""
    sigma_m = math.hypot(noise.gps_position_sigma_m, noise.gps_wander_sigma_m)
    gate_m, gate_mps = GATE_SIGMAS * sigma_m, GATE_SIGMAS * noise.gps_velocity_sigma_mps
    north, east, down = (a - b for a, b in zip(fix.position_m, before.position_m, strict=True))
    speed_mps = math.dist(fix.velocity_mps, before.velocity_mps)
    return Innovation(speed_mps / gate_mps, math.hypot(north, east) / gate_m, abs(down) / gate_m)
