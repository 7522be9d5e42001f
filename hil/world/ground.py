"""The ground under one body: rolling resistance, side grip, scrub and blocked wheels.

All are Coulomb friction, as joints to the ground whose force is limited: the solver settles them
together with the contacts, so they hold what is pushed too weakly and never reverse a motion.
"""

from collections.abc import Collection
from typing import TypeVar

import pymunk

from hil.airframe import Airframe

J = TypeVar("J", bound=pymunk.Constraint)
_GROOVE_HALF_M = 1.0  # only its direction matters


class Ground:
    """`hold` is called before each step, with what holds during it."""

    def __init__(
        self, space: pymunk.Space, body: pymunk.Body, frame: Airframe, yaw_locked: bool
    ) -> None:
        self._space, self._body, self._frame = space, body, frame
        self._rolling = self._add(
            pymunk.PivotJoint(space.static_body, body, (0, 0), (0, 0)), frame.rolling_force_n
        )
        self._scrub = None
        if not yaw_locked:
            gear = pymunk.GearJoint(space.static_body, body, 0.0, 1.0)
            self._scrub = self._add(gear, frame.yaw_resistance_nm)
        self._side = None
        if frame.side_grip > 0.0:
            self._side = self._add(self._groove((0.0, 0.0), (1.0, 0.0)), frame.side_grip_n)
        self._brakes: dict[int, pymunk.GrooveJoint] = {}
        self._share = 1.0

    def hold(self, share: float, locked: Collection[int]) -> None:
        """`share` of the full friction; `locked` are places (from 0) of blocked wheels."""
        if share != self._share:
            self._share = share
            self._rolling.max_force = share * self._frame.rolling_force_n
            if self._scrub:
                self._scrub.max_force = share * self._frame.yaw_resistance_nm
            if self._side:
                self._side.max_force = share * self._frame.side_grip_n
        if self._side:
            self._side.anchor_b = self._body.position
        if locked or self._brakes:
            self._brake(share, locked)

    def _brake(self, share: float, locked: Collection[int]) -> None:
        for i in set(self._brakes) - set(locked):
            self._space.remove(self._brakes.pop(i))
        for i in locked:
            motor = self._frame.motors[i]
            if motor.grip_n <= 0.0:
                continue
            if i not in self._brakes:
                (x, y), across = motor.position_m, (-motor.direction[1], motor.direction[0])
                self._brakes[i] = self._add(self._groove((x, y), across), motor.grip_n)
            self._brakes[i].anchor_b = self._body.local_to_world(motor.position_m)
            self._brakes[i].max_force = share * motor.grip_n

    def _groove(
        self, place_m: tuple[float, float], along: tuple[float, float]
    ) -> pymunk.GrooveJoint:
        """Free along a body direction, held across it, where the body touches the ground."""
        dx, dy = along[0] * _GROOVE_HALF_M, along[1] * _GROOVE_HALF_M
        ends = (place_m[0] - dx, place_m[1] - dy), (place_m[0] + dx, place_m[1] + dy)
        return pymunk.GrooveJoint(self._body, self._space.static_body, *ends, (0.0, 0.0))

    def _add(self, joint: J, limit: float) -> J:
        joint.max_force = limit
        joint.max_bias = 0.0  # resists velocity, never pulls towards a place
        self._space.add(joint)
        return joint
