"""The same drive in the pymunk world and in the twin, tick by tick.

The world's rovers have the control law of the simulated vehicles but know where they are: what is
compared is mechanics, motors and control, not sensors.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from base_station.belief.hypotheses import nominal
from base_station.twin import EAST, NORTH, FleetModel, advance, fault_rows, initial_state, perturbed
from hil.airframe import output_to_pwm
from hil.scenario import Scenario, station_view
from hil.world.space import World
from sim_vehicles.control import Drive, Memory, drive_at
from sim_vehicles.estimator import Estimate

Stretch = tuple[float, Sequence[tuple[float, float] | None]]  # seconds, velocity or HOLD each
EXACT = {"motor_gain_sigma": 0, "mass_sigma": 0, "rolling_sigma": 0, "contact_friction": 0.1}


@dataclass(frozen=True)
class Tracks:
    """Positions [T, V, 2] (m) at the autopilot's rate."""

    world: np.ndarray
    twin: np.ndarray

    @property
    def apart_m(self) -> float:
        """The largest distance of a vehicle in the one from itself in the other."""
        return float(np.linalg.norm(self.world - self.twin, axis=-1).max())

    @property
    def moved_m(self) -> np.ndarray:
        """[V], from first to last in the world."""
        return np.linalg.norm(self.world[-1] - self.world[0], axis=-1)

    @property
    def ends_apart_m(self) -> np.ndarray:
        """[V]"""
        return np.linalg.norm(self.world[-1] - self.twin[-1], axis=-1)


def scene(starts_m: Sequence[tuple[float, float]], yaw: str = "locked", **plant: Any) -> Scenario:
    fleet = [
        {
            "name": f"rover_{i}",
            "sysid": i,
            "start": {"north_m": n, "east_m": e},
            "goal": {"north_m": 0.0, "east_m": 0.0},
        }
        for i, (n, e) in enumerate(starts_m, start=1)
    ]
    arena = {"north_min_m": -20, "north_max_m": 20, "east_min_m": -20, "east_max_m": 20}
    tree = {"name": "plane", "arena": arena, "fleet": fleet, "yaw": yaw, "plant": EXACT | plant}
    return Scenario.model_validate(tree)


def side_by_side(scenario: Scenario, stretches: Sequence[Stretch], seed: int = 0) -> Tracks:
    return Tracks(in_world(scenario, stretches, seed), in_twin(scenario, stretches))


def in_twin(
    scenario: Scenario, stretches: Sequence[Stretch], draws: int | None = None
) -> np.ndarray:
    """[T, V, 2] of the nominal twin, or [T, draws, V, 2] of as many draws of its parameters."""
    model = FleetModel.from_view(station_view(scenario, 14550, 1))
    faults = fault_rows(model, [nominal(1)])
    starts = [(v.start.north_m, v.start.east_m) for v in scenario.fleet]
    parameters = perturbed(model, np.random.default_rng(0), draws) if draws else model.nominal
    rows = draws or 1
    states = initial_state([starts] * rows, np.zeros((rows, len(starts))))
    track = [states[..., NORTH : EAST + 1].copy()]
    for seconds, commands in stretches:
        setpoints = [(*(c or (0.0, 0.0)), math.nan) for c in commands]
        driven = [c is not None for c in commands]
        for _ in range(round(seconds / model.dt_s)):
            moved = advance(model, parameters, faults, states, setpoints, driven, model.dt_s)
            states = moved.states
            track.append(states[..., NORTH : EAST + 1].copy())
    tracks = np.array(track)
    return tracks if draws else tracks[:, 0]


def in_world(scenario: Scenario, stretches: Sequence[Stretch], seed: int) -> np.ndarray:
    world, locked = World(scenario, seed), scenario.yaw == "locked"
    drives = {v.sysid: Drive.of(v.frame, locked) for v in scenario.fleet}
    memories = dict.fromkeys(drives, Memory())
    dt_s = 1.0 / scenario.clock.autopilot_hz
    per_tick = scenario.clock.physics_hz // scenario.clock.autopilot_hz
    track = [_positions(world)]
    for seconds, commands in stretches:
        for _ in range(round(seconds / dt_s)):
            pwm: dict[int, list[int]] = {}
            for sysid, command in zip(drives, commands, strict=True):
                known = _known(world, sysid)
                if command is None:
                    memories[sysid] = Memory(yaw_rad=known.yaw_rad)
                    continue
                outputs, memories[sysid] = drive_at(
                    drives[sysid], memories[sysid], known, command, dt_s
                )
                pwm[sysid] = [output_to_pwm(u) for u in outputs]
            for _ in itertools.repeat(None, per_tick):
                world.step(pwm)
            track.append(_positions(world))
    return np.array(track)


def _known(world: World, sysid: int) -> Estimate:
    state = world.state(sysid)
    return Estimate(state.position_m, state.velocity_mps, state.attitude_rad[2], state.gyro_radps)


def _positions(world: World) -> np.ndarray:
    return np.array([(v.north_m, v.east_m) for v in world.truth().vehicles.values()])
