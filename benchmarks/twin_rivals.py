"""What the twin's speed is compared with: VMAS, and pymunk behind Gymnasium.

Each twice: bare discs under a force, as their tutorials have them, and rovers with the content of
the twin: velocity loop, motors, rolling resistance and a hypothesis' flags at every sub-step,
written as their users must. The rovers' yaw is locked, so here body axes are north and east, and
what the twin does for any motors is done per axis: less work for them. VMAS has no friction
between discs, pymunk's rovers have.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import pymunk
import torch

from hil.airframe import OMNI_PLUS

SUB_STEPS = 5
STEP_S = 0.1
SUB_S = STEP_S / SUB_STEPS
FORCE_N = 30.0
START_M = ((0.0, -0.65), (0.0, 0.0), (0.0, 0.65))

STALL_N = OMNI_PLUS.axis_stall_force_n("x")
PER_FREE = 1.0 / OMNI_PLUS.motors[0].free_speed_mps
ROLLING_OUTPUT = OMNI_PLUS.rolling_force_n / STALL_N
GAIN, LIMIT, STANDSTILL_MPS = 0.5 * SUB_S, 0.1, 0.02
FRICTION = 0.1


@dataclass(frozen=True)
class Subject:
    """What is measured: a step, and where the discs are [B, V, 2] (m) after those taken."""

    step: Callable[[], object]
    positions: Callable[[], np.ndarray]

    def touching(self) -> float:
        """The share of worlds in which two discs touch, within 5 mm."""
        at = self.positions()
        pairs = np.triu_indices(at.shape[1], 1)
        gaps = np.linalg.norm(at[:, pairs[0]] - at[:, pairs[1]], axis=-1)
        return float((gaps < 2.0 * OMNI_PLUS.radius_m + 0.005).any(axis=1).mean())


def actions(batch: int, count: int) -> Iterator[np.ndarray]:
    """A few random actions [B, V, 2] in [-1, 1] over and over, each five times running."""
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(-1.0, 1.0, (batch, count, 2)) for _ in range(6)]
    return itertools.cycle([action for action in drawn for _ in range(5)])


def vmas_discs(batch: int, half_m: tuple[float, float]) -> Subject:
    world = _vmas_world(batch, half_m, STEP_S, SUB_STEPS)
    forces, still = _tensors(FORCE_N, batch), torch.zeros((batch, 1))

    def step() -> None:
        force = next(forces)
        for i, agent in enumerate(world.agents):
            agent.state.force, agent.state.torque = force[:, i], still
        world.step()

    return Subject(step, lambda: _vmas_positions(world))


def vmas_rovers(batch: int, half_m: tuple[float, float]) -> Subject:
    """The autopilot for all agents at once: per agent, as `Dynamics` has it, is slower still."""
    rolling = OMNI_PLUS.rolling_force_n / OMNI_PLUS.mass_kg
    world = _vmas_world(batch, half_m, SUB_S, 1, linear_friction=rolling)
    setpoints, still = _tensors(1.0, batch), torch.zeros((batch, 1))
    integral = torch.zeros((batch, len(START_M), 2))
    power, seen = torch.ones((len(START_M), 2)), torch.ones((len(START_M), 2))

    def step() -> None:
        nonlocal integral
        setpoint = next(setpoints)
        against = ROLLING_OUTPUT * torch.sign(setpoint) * (setpoint.abs() >= STANDSTILL_MPS)
        feed_forward = setpoint * PER_FREE + against
        for _ in range(SUB_STEPS):
            velocity = torch.stack([a.state.vel for a in world.agents], dim=1)
            integral = (integral + GAIN * (setpoint - seen * velocity)).clamp(-LIMIT, LIMIT)
            output = feed_forward + integral
            output = output / output.abs().amax(dim=-1, keepdim=True).clamp(min=1.0)
            force = STALL_N * power * (output - velocity * PER_FREE)
            for i, agent in enumerate(world.agents):
                agent.state.force, agent.state.torque = force[:, i], still
            world.step()

    return Subject(step, lambda: _vmas_positions(world))


def _vmas_world(
    batch: int, half_m: tuple[float, float], dt_s: float, substeps: int, **agents: Any
) -> Any:
    from vmas.simulator.core import Agent, Sphere, World

    sides = {"x_semidim": half_m[0], "y_semidim": half_m[1]}
    drag = {"drag": 0.0} if agents else {}
    world = World(batch, torch.device("cpu"), dt=dt_s, substeps=substeps, **sides, **drag)
    for i, place in enumerate(START_M):
        shape = Sphere(OMNI_PLUS.radius_m)
        agent = Agent(f"rover_{i}", shape=shape, mass=OMNI_PLUS.mass_kg, rotatable=False, **agents)
        world.add_agent(agent)
        agent.state.pos = torch.tensor([place] * batch, dtype=torch.float32)
    return world


def _vmas_positions(world: Any) -> np.ndarray:
    return torch.stack([a.state.pos for a in world.agents], dim=1).numpy()


def _tensors(scale: float, batch: int) -> Iterator[torch.Tensor]:
    drawn = itertools.islice(actions(batch, len(START_M)), 30)
    return itertools.cycle([torch.tensor(scale * a, dtype=torch.float32) for a in drawn])


class PymunkDiscs(gymnasium.Env[np.ndarray, np.ndarray]):
    """What one would write first: a space of discs behind `step`; actions are forces."""

    damping = 0.5

    def __init__(self, half_m: tuple[float, float]) -> None:
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (12,))
        self.action_space = gymnasium.spaces.Box(-1.0, 1.0, (6,))
        self._space = pymunk.Space()
        self._space.damping = self.damping
        self._bodies = [self._disc(place) for place in START_M]
        x, y = half_m[0] + OMNI_PLUS.radius_m, half_m[1] + OMNI_PLUS.radius_m
        for a, b in itertools.pairwise([(-x, -y), (x, -y), (x, y), (-x, y), (-x, -y)]):
            self._space.add(pymunk.Segment(self._space.static_body, a, b, 0.0))

    def _disc(self, place: tuple[float, float]) -> pymunk.Body:
        body = pymunk.Body(OMNI_PLUS.mass_kg, math.inf)
        body.position = place
        self._space.add(body, pymunk.Circle(body, OMNI_PLUS.radius_m))
        return body

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, object]]:
        for _ in range(SUB_STEPS):
            self._drive(action)
            self._space.step(SUB_S)
        rows = [(*b.position, *b.velocity) for b in self._bodies]
        observation = np.array(rows, dtype=np.float32).ravel()
        return observation, float(-np.abs(observation[:6]).sum()), False, False, {}

    def _drive(self, action: np.ndarray) -> None:
        for i, body in enumerate(self._bodies):
            body.force = FORCE_N * float(action[2 * i]), FORCE_N * float(action[2 * i + 1])


class PymunkRovers(PymunkDiscs):
    """The same with autopilot, motors and ground; actions are velocities (m/s)."""

    damping = 1.0

    def __init__(self, half_m: tuple[float, float]) -> None:
        super().__init__(half_m)
        self._integrals = [[0.0, 0.0] for _ in self._bodies]
        self._power = [[1.0, 1.0] for _ in self._bodies]
        self._seen = [[1.0, 1.0] for _ in self._bodies]

    def _disc(self, place: tuple[float, float]) -> pymunk.Body:
        body = super()._disc(place)
        next(iter(body.shapes)).friction = math.sqrt(FRICTION)
        ground = pymunk.PivotJoint(self._space.static_body, body, (0.0, 0.0), (0.0, 0.0))
        ground.max_bias, ground.max_force = 0.0, OMNI_PLUS.rolling_force_n
        self._space.add(ground)
        return body

    def _drive(self, action: np.ndarray) -> None:
        for i, body in enumerate(self._bodies):
            outputs, velocity = [0.0, 0.0], body.velocity
            for k in range(2):
                setpoint = float(action[2 * i + k])
                integral = self._integrals[i][k]
                integral += GAIN * (setpoint - self._seen[i][k] * velocity[k])
                integral = self._integrals[i][k] = max(-LIMIT, min(LIMIT, integral))
                outputs[k] = setpoint * PER_FREE + integral
                if abs(setpoint) >= STANDSTILL_MPS:
                    outputs[k] += math.copysign(ROLLING_OUTPUT, setpoint)
            share = 1.0 / max(1.0, abs(outputs[0]), abs(outputs[1]))
            body.force = (
                STALL_N * self._power[i][0] * (share * outputs[0] - velocity[0] * PER_FREE),
                STALL_N * self._power[i][1] * (share * outputs[1] - velocity[1] * PER_FREE),
            )


def pymunk_step(env: PymunkDiscs) -> Callable[[], object]:
    following = actions(1, len(START_M))
    return lambda: env.step(next(following).ravel())
