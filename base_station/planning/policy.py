"""What the station needs at run time to drive a learned policy: plain numpy, pure functions."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from base_station.planning.requests import PolicyWeights
from base_station.twin import EAST, NORTH, V_EAST, V_NORTH, YAW, FleetModel
from hil.scenario import StationView

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FAR_M = 4.0  # scale of distances across the arena ...
NEAR_M = 0.3  # ... and of those that decide about a push or an arrival: below it a policy
# that eases off too early stalls, because pushing takes a third of full speed to start
SETTLED_MPS = 0.4  # a broken vehicle must not roll out of its goal: it coasts 8 cm from this speed


@dataclass(frozen=True)
class Commands:
    """How actions become set-points. `commanded` lists vehicles by index; the others wait in HOLD.

    A vehicle takes 2 numbers in [-1, 1] (velocity north, east), and with free yaw a third one.
    """

    vehicles: int
    commanded: tuple[int, ...]
    speed_mps: float
    yaw_free: bool

    @classmethod
    def of_view(cls, view: StationView, held: tuple[int, ...] = ()) -> Self:
        count = len(view.fleet)
        commanded = tuple(v for v in range(count) if v not in held)
        return cls(count, commanded, view.limits.speed_mps, view.yaw == "free")

    @property
    def size(self) -> int:
        """A, the numbers in an action."""
        return len(self.commanded) * (3 if self.yaw_free else 2)

    @property
    def driven(self) -> Flags:
        """[V], False for vehicles in HOLD."""
        return np.isin(np.arange(self.vehicles), self.commanded)


def to_setpoints(actions: Array, commands: Commands) -> Array:
    """Actions [..., A] to set-points [..., V, 3]: north and east (m/s), yaw (rad; NaN: none)."""
    lead = actions.shape[:-1]
    parts = np.clip(actions, -1.0, 1.0).reshape(*lead, len(commands.commanded), -1)
    setpoints = np.zeros((*lead, commands.vehicles, 3))
    setpoints[..., 2] = np.nan
    setpoints[..., commands.commanded, :2] = parts[..., :2] * commands.speed_mps
    if commands.yaw_free:
        setpoints[..., commands.commanded, 2] = parts[..., 2] * np.pi
    return setpoints


def act(weights: PolicyWeights, observations: Array) -> Array:
    """The deterministic action [B, A] in [-1, 1] of a tanh MLP for observations [B, O]."""
    *hidden, (last, bias) = weights.layers
    x = observations
    for matrix, offset in hidden:
        x = np.tanh(x @ matrix.T + offset)
    return np.clip(x @ last.T + bias, -1.0, 1.0)


def beta_observation(
    states: Array,
    delivered: Flags,
    time_fraction: Array,
    model: FleetModel,
    goals_m: Array,
    suspect: int,
) -> Array:
    """What the mission policy sees, [B, O], all within a few units.

    `states` [B, V, S] as the verdict's twin believes them, `delivered` [B, V], `time_fraction` [B]
    of the horizon, `goals_m` [V, 2], `suspect` the index of the broken vehicle.
    """
    rows = len(states)
    position = states[..., NORTH : EAST + 1]
    to_goal = goals_m - position
    to_suspect = np.delete(position - position[:, suspect, None], suspect, axis=1)
    blocks: list[Array] = [
        to_goal / FAR_M,
        np.tanh(to_goal / NEAR_M),
        to_suspect / FAR_M,
        np.tanh(to_suspect / NEAR_M),
        states[..., V_NORTH : V_EAST + 1] / model.vehicles.speed_limit_mps[:, None],
        delivered.astype(np.float64),
        time_fraction,
    ]
    if not model.vehicles.yaw_locked:
        blocks += [np.cos(states[..., YAW]), np.sin(states[..., YAW])]
    return np.concatenate([block.reshape(rows, -1) for block in blocks], axis=1)


def arrived(states: Array, goals_m: Array, radius_m: float, broken: int | None) -> Flags:
    """Which vehicles [B, V] are at their goals [V, 2]; a broken one must have slowed down, too."""
    distance = np.linalg.norm(goals_m - states[..., NORTH : EAST + 1], axis=-1)
    at_goal: Flags = distance <= radius_m
    if broken is not None:
        speed = np.linalg.norm(states[:, broken, V_NORTH : V_EAST + 1], axis=-1)
        at_goal[:, broken] &= speed <= SETTLED_MPS
    return at_goal
