"""Steering: a velocity in NED to motor outputs, for whatever airframe it is (pure)."""

from sim_vehicles.control import Drive, Memory, drive_at
from sim_vehicles.estimator import Estimate
from sim_vehicles.flying import fly_at
from sim_vehicles.sensors import Vector
from sim_vehicles.skidding import skid_at


def steer(
    drive: Drive, memory: Memory, estimate: Estimate, velocity_mps: Vector, dt_s: float
) -> tuple[tuple[float, ...], Memory]:
    """Motor outputs (-1..1) for a velocity (NED, m/s); down counts for what flies alone."""
    north, east, _ = velocity_mps
    if drive.airframe.steering == "flight":
        return fly_at(drive, memory, estimate, velocity_mps, dt_s)
    if drive.airframe.steering == "skid":
        return skid_at(drive, memory, estimate, (north, east), dt_s)
    return drive_at(drive, memory, estimate, (north, east), dt_s)
