"""What an experiment may do to the fleet: priced while it is learned, hard when it is chosen."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from base_station.twin import EAST, NORTH, V_EAST, V_NORTH, FleetModel
from hil.scenario import StationView

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

AT_A_WALL_M = 0.05
PRICE = 1.0  # per pair or vehicle, twin and control period in breach


@dataclass(frozen=True, eq=False)
class Limits:
    """`speed_mps` at which two vehicles may meet, `impulse_ns` between two in a control period,
    `may_touch` [V, V] symmetric, `margin_m` between a vehicle's rim and walls or obstacles;
    `may_brush` [V]: those that stand at a wall to begin with."""

    speed_mps: float
    impulse_ns: float
    may_touch: Flags
    margin_m: float
    may_brush: Flags

    @classmethod
    def of_view(cls, view: StationView, suspect: int, start: Array, model: FleetModel) -> Self:
        """The scenario's, and where vehicles are real those of `view.safety`, too; for twins that
        begin in `start` [H, V, S]."""
        given, safety, count = view.limits.manoeuvre, view.safety, len(view.fleet)
        allowed = safety is None or safety.allow_contact
        may_touch = np.full((count, count), given.contacts == "any" and allowed)
        if given.contacts == "suspect" and allowed:
            may_touch[suspect, :] = may_touch[:, suspect] = True
        spared = [v for v, member in enumerate(view.fleet) if member.sysid in given.untouchable]
        may_touch[spared, :] = may_touch[:, spared] = False
        return cls(
            min(given.contact_speed_mps or np.inf, safety.contact_speed_mps if safety else np.inf),
            given.contact_impulse_ns or np.inf,
            may_touch,
            max(given.wall_margin_m, safety.fence_margin_m if safety else 0.0),
            np.asarray((clearance_m(start, model) < AT_A_WALL_M).any(axis=0)),
        )

    @property
    def of_contacts(self) -> bool:
        """Must impulses be known?"""
        off_diagonal = ~np.eye(len(self.may_touch), dtype=np.bool_)
        return self.of_speed or self.impulse_ns < np.inf or not self.may_touch[off_diagonal].all()

    @property
    def any(self) -> bool:
        return self.of_contacts or self.margin_m > 0.0

    @property
    def of_speed(self) -> bool:
        """Must the speeds be known at which vehicles meet?"""
        return self.speed_mps < np.inf

    def breaches(self, contacts: "Contacts", states: Array, model: FleetModel) -> Array:
        """How many limits each row of a batch breaks, [B], after a control period."""
        count = np.zeros(len(states))
        if self.of_contacts:
            touched = contacts.impulses_ns > 0.0
            bad = touched & (~self.may_touch | (contacts.impulses_ns > self.impulse_ns))
            if self.of_speed:
                bad |= touched & (contacts.speeds_mps > self.speed_mps)
            count += bad.sum(axis=(1, 2)) / 2
        if self.margin_m > 0.0:
            near = clearance_m(states, model) < self.margin_m
            count += (near & ~self.may_brush).sum(axis=1)
        return count


@dataclass(frozen=True, eq=False)
class Contacts:
    """Of a control period or of a whole plan: `impulses_ns` [B, V, V] (sum), `speeds_mps` [B, V, V]
    (largest closing speed at which a pair met); zero-sized where nobody asks."""

    impulses_ns: Array
    speeds_mps: Array

    def add(self, other: "Contacts") -> None:
        """Of the period that follows, in place."""
        self.impulses_ns[...] += other.impulses_ns
        np.maximum(self.speeds_mps, other.speeds_mps, out=self.speeds_mps)

    @classmethod
    def none(cls, rows: int, vehicles: int, impulses: bool, speeds: bool) -> Self:
        pairs, timed = vehicles * impulses, vehicles * speeds
        return cls(np.zeros((rows, pairs, pairs)), np.zeros((rows, timed, timed)))


def clearance_m(states: Array, model: FleetModel) -> Array:
    """Between rims and the nearest wall or obstacle, [B, V], for states [B, V, S]."""
    low, high = model.vehicles.bounds_m[[0, 2]], model.vehicles.bounds_m[[1, 3]]
    position = states[..., NORTH : EAST + 1]
    room = np.minimum(position - low, high - position).min(axis=-1)
    for north, east, to_north, to_east, brush in model.vehicles.obstacles_m:
        start = np.array([north, east])
        way = np.array([to_north, to_east]) - start
        share = np.clip((position - start) @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        nearest = start + share[..., None] * way
        room = np.minimum(room, np.linalg.norm(position - nearest, axis=-1) - brush)
    return np.asarray(room - model.vehicles.radius_m)


def closing_mps(states: Array) -> Array:
    """How fast each pair's centres approach each other, [B, V, V], for states [B, V, S]."""
    apart = states[:, None, :, NORTH : EAST + 1] - states[:, :, None, NORTH : EAST + 1]
    relative = states[:, None, :, V_NORTH : V_EAST + 1] - states[:, :, None, V_NORTH : V_EAST + 1]
    distance = np.maximum(np.linalg.norm(apart, axis=-1), 1e-9)
    return np.asarray(-(apart * relative).sum(axis=-1) / distance)
