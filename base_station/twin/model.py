"""The fleet as arrays: what the data sheets say, what is uncertain, and what may be broken."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from base_station.autopilots import HeadingFirst, adapter
from base_station.belief.hypotheses import Hypothesis
from hil.airframe import Airframe, Motor
from hil.faults import NED_AXES, Type, Unit
from hil.scenario import Obstacle, Rectangle, StationView, Uncertainty

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

AS_ASSUMED = Uncertainty()
CONTACT_FRICTION = 0.1  # nominal, between two vehicles and between vehicle and wall


class Vehicles(NamedTuple):
    """What the kernel reads of the data sheets. M is the largest number of motors."""

    radius_m: Array  # [V]
    speed_limit_mps: Array  # [V]
    direction: Array  # [V, M, 2] body axes; zero where a vehicle has fewer motors
    arm_m: Array  # [V, M]
    mix: Array  # [V, M, 3] motor outputs per command of body x, y, yaw
    axis_free_speed_mps: Array  # [V, 2] feed-forward of the velocity loop: output per m/s ...
    axis_rolling: Array  # [V, 2] ... and the output that overcomes rolling resistance
    skid: Flags  # [V] steers by turning
    grips: Flags  # [V] wheels that can't roll sideways: without them, no side force is looked at
    turn_line: Array  # [V] feed-forward of a skid-steered turn: output per rad/s ...
    turn_scrub: Array  # [V] ... and the output that overcomes scrub
    heading_first: Flags  # [V] its autopilot has the `helm`, [V, 12] in the order of HeadingFirst
    helm: Array
    bounds_m: Array  # [4] north min, north max, east min, east max
    obstacles_m: Array  # [O, 5] strokes with a round brush: from and to (north, east), radius
    reach_m: float  # gaps that can close within a step
    yaw_locked: bool
    dt_s: float


class Parameters(NamedTuple):
    """What the station knows only roughly. One of P draws serves B / P consecutive batch rows."""

    stall_force_n: Array  # [P, V, M]
    free_speed_mps: Array  # [P, V, M] of a wheel; with force and mass it is the time constant
    mass_kg: Array  # [P, V]
    inertia_kgm2: Array  # [P, V]
    rolling_force_n: Array  # [P, V]
    side_force_n: Array  # [P, V] that wheels which can't roll sideways withstand
    yaw_resistance_nm: Array  # [P, V]
    friction: Array  # [P]
    latency_s: Array  # [P] from sending a set-point to its effect


class FaultArrays(NamedTuple):
    """Hypotheses as flags; batch row b is under hypothesis b % H."""

    power: Array  # [H, V, M] 1: the motor pulls; 0: its wheel runs free
    gain: Array  # [H, V, M] of its output; a weak motor still brakes like a sound one
    gps_stuck: Array  # [H, V, 2] 1: the NED axis (north, east) is frozen


@dataclass(frozen=True, eq=False)
class FleetModel:
    """The nominal twin of a fleet, in the order of `view.fleet`."""

    sysids: tuple[int, ...]
    vehicles: Vehicles
    nominal: Parameters  # P = 1
    declared: Uncertainty = AS_ASSUMED

    @classmethod
    def from_view(cls, view: StationView) -> Self:
        frames = [member.frame for member in view.fleet]
        helms = [adapter(member.autopilot, member.frame).helm for member in view.fleet]
        motors = max(len(f.motors) for f in frames)
        fastest_mps = max(m.free_speed_mps for f in frames for m in f.motors)
        vehicles = Vehicles(
            radius_m=np.array([f.radius_m for f in frames]),
            speed_limit_mps=np.array([f.speed_limit_mps for f in frames]),
            direction=np.array([_padded([m.direction for m in f.motors], motors) for f in frames]),
            arm_m=np.array([_padded([m.arm_m for m in f.motors], motors) for f in frames]),
            mix=np.array([_padded([_mixed(m) for m in f.motors], motors) for f in frames]),
            axis_free_speed_mps=np.array(
                [[_axis_free_speed(f, axis) for axis in ("x", "y")] for f in frames]
            ),
            axis_rolling=np.array(
                [[_axis_rolling(f, axis) for axis in ("x", "y")] for f in frames]
            ),
            skid=np.array([f.steering == "skid" for f in frames]),
            grips=np.array([f.side_grip_n > 0.0 for f in frames]),
            turn_line=np.array([_turn(f)[0] for f in frames]),
            turn_scrub=np.array([_turn(f)[1] for f in frames]),
            heading_first=np.array([h is not None for h in helms]),
            helm=np.array([h or (0.0,) * len(HeadingFirst._fields) for h in helms]),
            bounds_m=_bounds_m(view.arena),
            obstacles_m=_strokes_m(view.obstacles),
            reach_m=2.0 * fastest_mps / view.clock.autopilot_hz,
            yaw_locked=view.yaw == "locked",
            dt_s=1.0 / view.clock.autopilot_hz,
        )
        stall = [_padded([m.stall_force_n for m in f.motors], motors) for f in frames]
        nominal = Parameters(
            stall_force_n=np.array([stall]),
            free_speed_mps=np.array(
                [[_padded([m.free_speed_mps for m in f.motors], motors, 1.0) for f in frames]]
            ),
            mass_kg=np.array([[f.mass_kg for f in frames]]),
            inertia_kgm2=np.array([[f.yaw_inertia_kgm2 for f in frames]]),
            rolling_force_n=np.array([[f.rolling_force_n for f in frames]]),
            side_force_n=np.array([[f.side_grip_n for f in frames]]),
            yaw_resistance_nm=np.array([[f.yaw_resistance_nm for f in frames]]),
            friction=np.array([CONTACT_FRICTION]),
            latency_s=np.zeros(1),
        )
        sysids = tuple(member.sysid for member in view.fleet)
        return cls(sysids, vehicles, nominal, view.uncertainty)

    def within(self, area: Rectangle) -> Self:
        """The same fleet with walls around `area`."""
        return replace(self, vehicles=self.vehicles._replace(bounds_m=_bounds_m(area)))

    @property
    def size(self) -> int:
        """V, the number of vehicles."""
        return len(self.sysids)

    @property
    def dt_s(self) -> float:
        return float(self.vehicles.dt_s)

    def index(self, sysid: int) -> int:
        return self.sysids.index(sysid)


def perturbed(
    model: FleetModel, rng: np.random.Generator, n: int, declared: Uncertainty | None = None
) -> Parameters:
    """`n` draws of the uncertain parameters (P = n), from the ranges that the view declares."""
    nominal, v = model.nominal, model.size
    declared = declared or model.declared
    mass = 1.0 + declared.mass_sigma * rng.standard_normal((n, v))
    rolling = mass * _positive(1.0 + declared.rolling_sigma * rng.standard_normal((n, v)))
    gain_shape = (n, *nominal.stall_force_n.shape[1:])
    gain = 1.0 + declared.motor_gain_sigma * rng.standard_normal(gain_shape)
    friction = rng.uniform(0.0, declared.friction_max, n)
    latency = rng.uniform(0.0, declared.latency_max_s, n)
    speed = np.ones(gain_shape)
    if declared.free_speed_sigma > 0.0:
        speed = _positive(1.0 + declared.free_speed_sigma * rng.standard_normal(gain_shape))
    return Parameters(
        stall_force_n=nominal.stall_force_n * gain,
        mass_kg=nominal.mass_kg * mass,
        inertia_kgm2=nominal.inertia_kgm2 * mass,
        free_speed_mps=nominal.free_speed_mps * speed,
        rolling_force_n=nominal.rolling_force_n * rolling,
        side_force_n=nominal.side_force_n * mass,
        yaw_resistance_nm=nominal.yaw_resistance_nm * rolling,
        friction=friction,
        latency_s=latency,
    )


def fault_rows(model: FleetModel, hypotheses: Sequence[Hypothesis]) -> FaultArrays:
    """Each hypothesis as flags. Raises ValueError for one that has no twin."""
    shape = (len(hypotheses), *model.nominal.stall_force_n.shape[1:])
    power, gain = np.ones(shape), np.ones(shape)
    stuck = np.zeros((*shape[:2], 2))
    for h, hypothesis in enumerate(hypotheses):
        if not hypothesis.has_twin:
            raise ValueError(f"hypothesis {hypothesis.name!r} has no twin; leave it out")
        fault, v = hypothesis.fault, model.index(hypothesis.sysid)
        if fault is None:
            continue
        motors = [i - 1 for i in fault.instances] or slice(None)
        if (fault.unit, fault.type) == (Unit.MOTOR, Type.OFF):
            power[h, v, motors] = 0.0
        elif (fault.unit, fault.type) == (Unit.MOTOR, Type.PARTIAL):
            gain[h, v, motors] = fault.size[0]
        elif (fault.unit, fault.type) == (Unit.MOTOR, Type.REVERSED):
            gain[h, v, motors] = -1.0
        elif (fault.unit, fault.type) == (Unit.GPS, Type.STUCK):
            for k, axis in enumerate(NED_AXES[:2]):
                stuck[h, v, k] = float(not fault.axes or axis in fault.axes)
        elif fault.unit is not Unit.GPS:  # other GPS faults change reports, not how it drives
            raise ValueError(f"hypothesis {hypothesis.name!r}: no twin for {fault}")
    return FaultArrays(power, gain, stuck)


def _bounds_m(area: Rectangle) -> Array:
    sides_m = [area.north_min_m, area.north_max_m, area.east_min_m, area.east_max_m]
    return np.array(sides_m, dtype=np.float64)


def _strokes_m(obstacles: Sequence[Obstacle]) -> Array:
    """[O, 5], as the kernel wants them."""
    rows = [
        (a.north_m, a.east_m, b.north_m, b.east_m, obstacle.radius_m)
        for obstacle in obstacles
        for a, b in [obstacle.ends]
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def _padded(rows: Sequence[object], length: int, fill: float = 0.0) -> Array:
    """Rows as an array, with rows of `fill` appended up to `length`."""
    array = np.asarray(rows, dtype=np.float64)
    out = np.full((length, *array.shape[1:]), fill)
    out[: len(array)] = array
    return out


def _axis_free_speed(frame: Airframe, axis: str) -> float:
    speeds = [frame.motors[i - 1].free_speed_mps for i in frame.axis_motors(axis)]
    return sum(speeds) / len(speeds) if speeds else math.inf


def _mixed(motor: Motor) -> tuple[float, float, float]:
    """As `hil.airframe.mix` shares out body commands."""
    return (*motor.direction, math.copysign(1.0, motor.arm_m))


def _turn(frame: Airframe) -> tuple[float, float]:
    """Output per rad/s and against scrub, as a skid-steered vehicle's autopilot has them."""
    if frame.steering != "skid":
        return 0.0, 0.0
    motor = frame.motors[0]
    stall_nm = sum(m.stall_force_n * abs(m.arm_m) for m in frame.motors)
    return abs(motor.arm_m) / motor.free_speed_mps, frame.yaw_resistance_nm / stall_nm


def _axis_rolling(frame: Airframe, axis: str) -> float:
    stall = frame.axis_stall_force_n(axis)
    return frame.rolling_force_n / stall if stall else 0.0


def _positive(factor: Array) -> Array:
    return np.maximum(factor, 0.1)
