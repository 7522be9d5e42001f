"""The world: discs on a plane with walls, seen from above, in pymunk.

pymunk's x is north, its y is east and its angle is yaw, so that NED and pymunk agree. Rolling
resistance is Coulomb friction with the ground, as a joint to it whose force is limited: the
solver settles it together with the contacts, so it holds what is pushed too weakly and never
reverses a motion.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import pymunk

from hil.airframe import GRAVITY_MPS2, Airframe, motor_forces, pwm_to_output
from hil.frames import body_to_ned, ned_to_body, wrap_pi
from hil.physics_link import AT_REST_MPS2, PhysicsState
from hil.scenario import Arena, Scenario, Vehicle
from hil.world.plant import real_airframe
from hil.world.truth import Contact, TruthRecord, VehicleTruth

SOLVER_ITERATIONS = 30
OVERLAP_ALLOWED_M = 0.0005
WALL_HALF_THICKNESS_M = 0.25
_VEHICLE, _WALL = 1, 2  # collision types


class _Rover:
    """A body, the airframe it really has, and where its frame began."""

    def __init__(self, vehicle: Vehicle, frame: Airframe, body: pymunk.Body) -> None:
        self.name, self.frame, self.body = vehicle.name, frame, body
        self.last: PhysicsState | None = None

    def drive(self, pwm_us: Sequence[int]) -> None:
        outputs = [pwm_to_output(pwm) for pwm in pwm_us[: len(self.frame.motors)]]
        outputs += [None] * (len(self.frame.motors) - len(outputs))
        yaw, velocity = self.body.angle, self.body.velocity
        velocity_body = ned_to_body(velocity.x, velocity.y, yaw)
        fx, fy, torque = motor_forces(
            self.frame, outputs, velocity_body, self.body.angular_velocity
        )
        self.body.force = body_to_ned(fx, fy, yaw)
        self.body.torque = torque

    def state(self, time_s: float) -> PhysicsState:
        (vn, ve), (n, e), yaw = self.body.velocity, self.body.position, self.body.angle
        accel = AT_REST_MPS2
        if self.last is not None and time_s > self.last.time_s:
            dt = time_s - self.last.time_s
            dvn, dve = vn - self.last.velocity_mps[0], ve - self.last.velocity_mps[1]
            accel = (*ned_to_body(dvn / dt, dve / dt, yaw), -GRAVITY_MPS2)
        return PhysicsState(
            time_s=time_s,
            gyro_radps=(0.0, 0.0, self.body.angular_velocity),
            accel_body_mps2=accel,
            position_m=(n, e, 0.0),
            velocity_mps=(vn, ve, 0.0),
            attitude_rad=(0.0, 0.0, wrap_pi(yaw)),
        )


class World:
    """All bodies of a scenario. Steps are `1 / physics_hz` long; no clock, no I/O."""

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.steps = 0
        self.physics_hz = scenario.clock.physics_hz
        self._space = pymunk.Space()
        self._space.iterations = SOLVER_ITERATIONS
        self._space.collision_slop = OVERLAP_ALLOWED_M
        # pairs multiply their coefficients
        self._friction = math.sqrt(scenario.plant.contact_friction)
        self._contacts: list[Contact] = []
        self._names: dict[pymunk.Shape, str] = {}
        self._add_walls(scenario.arena)
        self._rovers = {
            v.sysid: self._add_rover(
                v, real_airframe(v.frame, scenario.plant, seed, v.sysid), scenario.yaw == "locked"
            )
            for v in scenario.fleet
        }
        self._space.on_collision(_VEHICLE, _VEHICLE, post_solve=self._touched)
        self._space.on_collision(_VEHICLE, _WALL, post_solve=self._touched)

    @property
    def time_s(self) -> float:
        return self.steps / self.physics_hz

    def step(self, outputs: Mapping[int, Sequence[int]]) -> None:
        """One physics step under PWM outputs (us) by system id; who is missing has no power."""
        self._contacts.clear()
        for sysid, rover in self._rovers.items():
            rover.drive(outputs.get(sysid, ()))
        self.steps += 1
        self._space.step(1.0 / self.physics_hz)

    def state(self, sysid: int) -> PhysicsState:
        """The reply that ends a frame; its acceleration is the mean since the previous reply."""
        rover = self._rovers[sysid]
        if rover.last is None or rover.last.time_s != self.time_s:
            rover.last = rover.state(self.time_s)
        return rover.last

    def truth(self) -> TruthRecord:
        """Where everything is now."""
        return TruthRecord(self.time_s, {s: _truth(r.body) for s, r in self._rovers.items()})

    def contacts(self) -> tuple[Contact, ...]:
        """Who touched whom during the last step, walls included."""
        return tuple(self._contacts)

    def _touched(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        first, second = sorted(self._names[shape] for shape in arbiter.shapes)
        impulse_ns = arbiter.total_impulse.length
        points = arbiter.contact_point_set.points
        if impulse_ns > 0.0 and points:
            point_m = (points[0].point_a.x, points[0].point_a.y)
            self._contacts.append(Contact(self.time_s, (first, second), impulse_ns, point_m))

    def _add_rover(self, vehicle: Vehicle, frame: Airframe, yaw_locked: bool) -> _Rover:
        inertia = math.inf if yaw_locked else frame.yaw_inertia_kgm2
        body = pymunk.Body(frame.mass_kg, inertia)
        body.position = vehicle.start.north_m, vehicle.start.east_m
        body.angle = math.radians(vehicle.start_yaw_deg)
        self._space.add(body)
        self._add_shape(pymunk.Circle(body, frame.radius_m), vehicle.name, _VEHICLE)
        ground = self._space.static_body
        joints: list[pymunk.Constraint] = [pymunk.PivotJoint(ground, body, (0, 0), (0, 0))]
        limits = [frame.rolling_force_n]
        if not yaw_locked:
            joints.append(pymunk.GearJoint(ground, body, 0.0, 1.0))
            limits.append(frame.yaw_resistance_nm)
        for joint, limit in zip(joints, limits, strict=True):
            joint.max_force = limit
            joint.max_bias = 0.0  # resists velocity, never pulls towards a place
            self._space.add(joint)
        return _Rover(vehicle, frame, body)

    def _add_walls(self, arena: Arena) -> None:
        t = WALL_HALF_THICKNESS_M
        north, south = arena.north_max_m + t, arena.north_min_m - t
        east, west = arena.east_max_m + t, arena.east_min_m - t
        sides = {
            "wall_north": ((north, west), (north, east)),
            "wall_south": ((south, west), (south, east)),
            "wall_east": ((south, east), (north, east)),
            "wall_west": ((south, west), (north, west)),
        }
        for name, (a, b) in sides.items():
            self._add_shape(pymunk.Segment(self._space.static_body, a, b, t), name, _WALL)

    def _add_shape(self, shape: pymunk.Shape, name: str, collision_type: int) -> None:
        shape.elasticity = 0.0
        shape.friction = self._friction
        shape.collision_type = collision_type
        self._names[shape] = name
        self._space.add(shape)


def _truth(body: pymunk.Body) -> VehicleTruth:
    (n, e), (vn, ve) = body.position, body.velocity
    return VehicleTruth(n, e, wrap_pi(body.angle), vn, ve)
