"""The world: discs on a plane with walls, seen from above, in pymunk.

pymunk's x is north, its y is east and its angle is yaw, so that NED and pymunk agree. What flies
has height and tilt beside the plane (`flight`), and meets the others only at the same height.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import pymunk

from hil.airframe import (
    GRAVITY_MPS2,
    Airframe,
    lift,
    locked_motors,
    motor_forces,
    pwm_to_output,
)
from hil.frames import body_to_ned, ned_to_body, wrap_pi
from hil.physics_link import AT_REST_MPS2, PhysicsState, Vector3
from hil.scenario import Arena, Obstacle, Scenario, Vehicle
from hil.world.flight import Air, in_body, load_n, step, thrust_ned
from hil.world.ground import Ground
from hil.world.plant import real_airframe
from hil.world.terrain import (
    Ambient,
    ambient,
    change_times_s,
    drag_n,
    friction_factor,
    slope_force_n,
    wind_force_n,
)
from hil.world.truth import Contact, TruthRecord, VehicleTruth

SOLVER_ITERATIONS = 30
OVERLAP_ALLOWED_M = 0.0005
WALL_HALF_THICKNESS_M = 0.25
_VEHICLE, _WALL = 1, 2  # collision types


class _Vehicle:
    """A body, the airframe it really has, the ground under it, and where its frame began."""

    def __init__(
        self, vehicle: Vehicle, frame: Airframe, body: pymunk.Body, ground: Ground
    ) -> None:
        self.name, self.frame, self.body, self.ground = vehicle.name, frame, body, ground
        self.air = Air()
        self.last: PhysicsState | None = None

    @property
    def velocity_mps(self) -> Vector3:
        north, east = self.body.velocity  # asked once: each time, pymunk asks its library
        return north, east, self.air.down_mps

    def drive(self, pwm_us: Sequence[int], terrain: Ambient, dt_s: float) -> None:
        """Forces for the next step: motors, slope, wind, and what the ground may hold."""
        outputs, locked = _powered(tuple(pwm_us), len(self.frame.motors))
        friction = friction_factor(terrain, *self.body.position) if terrain.patches else 1.0
        if self.frame.flight is None:
            self._roll(outputs, terrain)
            self.ground.hold(friction, locked)
        else:
            load_n = self._fly(outputs, terrain, dt_s)
            self.ground.hold(friction * load_n / self.frame.weight_n, ())

    def _roll(self, outputs: Sequence[float | None], terrain: Ambient) -> None:
        yaw, velocity_mps = self.body.angle, self.velocity_mps
        velocity_body = ned_to_body(velocity_mps[0], velocity_mps[1], yaw)
        fx, fy, torque = motor_forces(
            self.frame, outputs, velocity_body, self.body.angular_velocity
        )
        north, east = body_to_ned(fx, fy, yaw)
        down_n, down_e = slope_force_n(terrain.slope, self.frame.mass_kg)
        wind_n, wind_e, _ = wind_force_n(self.frame, terrain.wind, velocity_mps)
        self.body.force = north + down_n + wind_n, east + down_e + wind_e
        self.body.torque = torque

    def _fly(self, outputs: Sequence[float | None], terrain: Ambient, dt_s: float) -> float:
        """Returns what the ground carries (N)."""
        rotors = lift(self.frame, outputs)
        north, east, down = thrust_ned(self.air, self.body.angle, rotors.thrust_n)
        drag = drag_n(self.frame, terrain.wind, self.velocity_mps)
        self.body.force = north + drag[0], east + drag[1]
        self.body.torque = rotors.yaw_nm
        carried_n = load_n(self.frame, self.air, down + drag[2])
        self.air = step(self.frame, self.air, rotors, down + drag[2], dt_s)
        return carried_n

    def touches(self, other: "_Vehicle") -> bool:
        """Whether both are somewhere at the same height."""
        low, high = -self.air.down_m, -self.air.down_m + self.frame.height_m
        return low <= -other.air.down_m + other.frame.height_m and -other.air.down_m <= high

    def state(self, time_s: float, terrain: Ambient) -> PhysicsState:
        (n, e), yaw, air = self.body.position, self.body.angle, self.air
        velocity = self.velocity_mps
        accel = AT_REST_MPS2
        if self.last is not None and time_s > self.last.time_s:
            dt = time_s - self.last.time_s
            accel = self._specific_force(self.last.velocity_mps, dt, terrain)
        return PhysicsState(
            time_s=time_s,
            gyro_radps=(*air.rates_radps, self.body.angular_velocity),
            accel_body_mps2=accel,
            position_m=(n, e, air.down_m),
            velocity_mps=velocity,
            attitude_rad=(air.roll_rad, air.pitch_rad, wrap_pi(yaw)),
        )

    def _specific_force(self, before_mps: Vector3, dt: float, terrain: Ambient) -> Vector3:
        """What an accelerometer feels (body): acceleration less gravity, mean over the frame."""
        n, e, d = (
            (now - then) / dt for now, then in zip(self.velocity_mps, before_mps, strict=True)
        )
        if self.frame.flight is not None:
            return in_body((n, e, d - GRAVITY_MPS2), self.air, self.body.angle)
        down_n, down_e = slope_force_n(terrain.slope, self.frame.mass_kg)
        n, e = n - down_n / self.frame.mass_kg, e - down_e / self.frame.mass_kg
        return (*ned_to_body(n, e, self.body.angle), -GRAVITY_MPS2)


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
        self._terrain = scenario.terrain
        self._ambient = ambient(scenario.terrain, 0.0)
        self._changes_s = change_times_s(scenario.terrain)  # those to come
        self._add_walls(scenario.arena)
        self._add_obstacles(scenario.obstacles)
        self._vehicles = {
            v.sysid: self._add_vehicle(
                v, real_airframe(v.frame, scenario.plant, seed, v.sysid), scenario.yaw == "locked"
            )
            for v in scenario.fleet
        }
        self._by_name = {v.name: v for v in self._vehicles.values()}
        self._space.on_collision(_VEHICLE, _VEHICLE, post_solve=self._touched)
        if any(v.frame.flight for v in self._vehicles.values()):
            self._space.on_collision(_VEHICLE, _VEHICLE, pre_solve=self._pass_over)
        self._space.on_collision(_VEHICLE, _WALL, post_solve=self._touched)

    @property
    def time_s(self) -> float:
        return self.steps / self.physics_hz

    def step(self, outputs: Mapping[int, Sequence[int]]) -> None:
        """One physics step under PWM outputs (us) by system id; who is missing has no power."""
        self._contacts.clear()
        if self._changes_s and self.time_s >= self._changes_s[0] - 1e-9:
            self._ambient = ambient(self._terrain, self.time_s)
            self._changes_s = [s for s in self._changes_s if s > self.time_s + 1e-9]
        for sysid, vehicle in self._vehicles.items():
            vehicle.drive(outputs.get(sysid, ()), self._ambient, 1.0 / self.physics_hz)
        self.steps += 1
        self._space.step(1.0 / self.physics_hz)

    def state(self, sysid: int) -> PhysicsState:
        """The reply that ends a frame; its acceleration is the mean since the previous reply."""
        vehicle = self._vehicles[sysid]
        if vehicle.last is None or vehicle.last.time_s != self.time_s:
            vehicle.last = vehicle.state(self.time_s, self._ambient)
        return vehicle.last

    def truth(self) -> TruthRecord:
        """Where everything is now."""
        return TruthRecord(self.time_s, {s: _truth(v) for s, v in self._vehicles.items()})

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

    def _pass_over(self, arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: Any) -> None:
        first, second = (self._by_name[self._names[shape]] for shape in arbiter.shapes)
        arbiter.process_collision = first.touches(second)

    def _add_vehicle(self, vehicle: Vehicle, frame: Airframe, yaw_locked: bool) -> _Vehicle:
        inertia = math.inf if yaw_locked else frame.yaw_inertia_kgm2
        body = pymunk.Body(frame.mass_kg, inertia)
        body.position = vehicle.start.north_m, vehicle.start.east_m
        body.angle = math.radians(vehicle.start_yaw_deg)
        self._space.add(body)
        self._add_shape(pymunk.Circle(body, frame.radius_m), vehicle.name, _VEHICLE)
        return _Vehicle(vehicle, frame, body, Ground(self._space, body, frame, yaw_locked))

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

    def _add_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Walls, too: whoever looks at contacts need not tell them apart."""
        for k, obstacle in enumerate(obstacles):
            a, b = ((p.north_m, p.east_m) for p in obstacle.ends)
            shape = pymunk.Segment(self._space.static_body, a, b, obstacle.radius_m)
            self._add_shape(shape, f"wall_obstacle_{k}", _WALL)

    def _add_shape(self, shape: pymunk.Shape, name: str, collision_type: int) -> None:
        shape.elasticity = 0.0
        shape.friction = self._friction
        shape.collision_type = collision_type
        self._names[shape] = name
        self._space.add(shape)


@lru_cache(maxsize=256)
def _powered(
    pwm_us: tuple[int, ...], motors: int
) -> tuple[tuple[float | None, ...], frozenset[int]]:
    """Outputs of so many motors, and which wheels are blocked. A frame holds for several steps."""
    driven = pwm_us[:motors]
    outputs = tuple(pwm_to_output(pwm) for pwm in driven)
    return outputs + (None,) * (motors - len(driven)), locked_motors(driven)


def _truth(vehicle: _Vehicle) -> VehicleTruth:
    (n, e), (vn, ve), air = vehicle.body.position, vehicle.body.velocity, vehicle.air
    return VehicleTruth(n, e, wrap_pi(vehicle.body.angle), vn, ve, air.down_m, air.down_mps)
