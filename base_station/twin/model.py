"""The fleet as arrays: what the data sheets say, what is uncertain, and what may be broken."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from base_station.hypotheses import Hypothesis
from hil.airframe import Airframe
from hil.faults import NED_AXES, Type, Unit
from hil.scenario import Rectangle, StationView

Array = NDArray[np.float64]

CONTACT_FRICTION = 0.1  # nominal, between two vehicles and between vehicle and wall


class Vehicles(NamedTuple):
    """What the kernel reads of the data sheets. M is the largest number of motors."""

    radius_m: Array  # [V]
    speed_limit_mps: Array  # [V]
    direction: Array  # [V, M, 2] body axes; zero where a vehicle has fewer motors
    arm_m: Array  # [V, M]
    free_speed_mps: Array  # [V, M]
    axis_free_speed_mps: Array  # [V, 2] feed-forward of the velocity loop: output per m/s ...
    axis_rolling: Array  # [V, 2] ... and the output that overcomes rolling resistance
    bounds_m: Array  # [4] north min, north max, east min, east max
    yaw_locked: bool
    dt_s: float


class Parameters(NamedTuple):
    """What the station knows only roughly. One of P draws serves B / P consecutive batch rows."""

    stall_force_n: Array  # [P, V, M]
    mass_kg: Array  # [P, V]
    inertia_kgm2: Array  # [P, V]
    rolling_force_n: Array  # [P, V]
    yaw_resistance_nm: Array  # [P, V]
    friction: Array  # [P]
    latency_s: Array  # [P] from sending a set-point to its effect


class FaultArrays(NamedTuple):
    """Hypotheses as flags; batch row b is under hypothesis b % H."""

    power: Array  # [H, V, M] 1: the motor pulls; 0: its wheel runs free
    gps_stuck: Array  # [H, V, 2] 1: the NED axis (north, east) is frozen


@dataclass(frozen=True)
class Uncertainty:
    """Declared ranges: sigma of a factor around 1, or upper end of a uniform draw from 0."""

    motor_gain_sigma: float = 0.03
    mass_sigma: float = 0.02
    rolling_sigma: float = 0.10
    friction_max: float = 0.3
    latency_max_s: float = 0.1


DECLARED = Uncertainty()


@dataclass(frozen=True, eq=False)
class FleetModel:
    """The nominal twin of a fleet, in the order of `view.fleet`."""

    sysids: tuple[int, ...]
    vehicles: Vehicles
    nominal: Parameters  # P = 1

    @classmethod
    def from_view(cls, view: StationView) -> Self:
        frames = [member.frame for member in view.fleet]
        motors = max(len(f.motors) for f in frames)
        vehicles = Vehicles(
            radius_m=np.array([f.radius_m for f in frames]),
            speed_limit_mps=np.array([f.speed_limit_mps for f in frames]),
            direction=np.array([_padded([m.direction for m in f.motors], motors) for f in frames]),
            arm_m=np.array([_padded([m.arm_m for m in f.motors], motors) for f in frames]),
            free_speed_mps=np.array(
                [_padded([m.free_speed_mps for m in f.motors], motors, 1.0) for f in frames]
            ),
            axis_free_speed_mps=np.array(
                [[_axis_free_speed(f, axis) for axis in ("x", "y")] for f in frames]
            ),
            axis_rolling=np.array(
                [[_axis_rolling(f, axis) for axis in ("x", "y")] for f in frames]
            ),
            bounds_m=_bounds_m(view.arena),
            yaw_locked=view.yaw == "locked",
            dt_s=1.0 / view.clock.autopilot_hz,
        )
        stall = [_padded([m.stall_force_n for m in f.motors], motors) for f in frames]
        nominal = Parameters(
            stall_force_n=np.array([stall]),
            mass_kg=np.array([[f.mass_kg for f in frames]]),
            inertia_kgm2=np.array([[f.yaw_inertia_kgm2 for f in frames]]),
            rolling_force_n=np.array([[f.rolling_force_n for f in frames]]),
            yaw_resistance_nm=np.array([[f.yaw_resistance_nm for f in frames]]),
            friction=np.array([CONTACT_FRICTION]),
            latency_s=np.zeros(1),
        )
        return cls(tuple(member.sysid for member in view.fleet), vehicles, nominal)

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
    model: FleetModel, rng: np.random.Generator, n: int, declared: Uncertainty = DECLARED
) -> Parameters:
    """`n` draws of the uncertain parameters (P = n)."""
    nominal, v = model.nominal, model.size
    mass = 1.0 + declared.mass_sigma * rng.standard_normal((n, v))
    rolling = mass * _positive(1.0 + declared.rolling_sigma * rng.standard_normal((n, v)))
    gain_shape = (n, *nominal.stall_force_n.shape[1:])
    gain = 1.0 + declared.motor_gain_sigma * rng.standard_normal(gain_shape)
    return Parameters(
        stall_force_n=nominal.stall_force_n * gain,
        mass_kg=nominal.mass_kg * mass,
        inertia_kgm2=nominal.inertia_kgm2 * mass,
        rolling_force_n=nominal.rolling_force_n * rolling,
        yaw_resistance_nm=nominal.yaw_resistance_nm * rolling,
        friction=rng.uniform(0.0, declared.friction_max, n),
        latency_s=rng.uniform(0.0, declared.latency_max_s, n),
    )


def fault_rows(model: FleetModel, hypotheses: Sequence[Hypothesis]) -> FaultArrays:
    """Each hypothesis as flags. Raises ValueError for one that has no twin."""
    shape = (len(hypotheses), *model.nominal.stall_force_n.shape[1:])
    power = np.ones(shape)
    stuck = np.zeros((*shape[:2], 2))
    for h, hypothesis in enumerate(hypotheses):
        if not hypothesis.has_twin:
            raise ValueError(f"hypothesis {hypothesis.name!r} has no twin; leave it out")
        fault, v = hypothesis.fault, model.index(hypothesis.sysid)
        if fault is None:
            continue
        if (fault.unit, fault.type) == (Unit.MOTOR, Type.OFF):
            power[h, v, [i - 1 for i in fault.instances] or slice(None)] = 0.0
        elif (fault.unit, fault.type) == (Unit.GPS, Type.STUCK):
            for k, axis in enumerate(NED_AXES[:2]):
                stuck[h, v, k] = float(not fault.axes or axis in fault.axes)
        else:
            raise ValueError(f"hypothesis {hypothesis.name!r}: no twin for {fault}")
    return FaultArrays(power, stuck)


def _bounds_m(area: Rectangle) -> Array:
    return np.array([area.north_min_m, area.north_max_m, area.east_min_m, area.east_max_m])


def _padded(rows: Sequence[object], length: int, fill: float = 0.0) -> Array:
    """Rows as an array, with rows of `fill` appended up to `length`."""
    array = np.asarray(rows, dtype=np.float64)
    out = np.full((length, *array.shape[1:]), fill)
    out[: len(array)] = array
    return out


def _axis_free_speed(frame: Airframe, axis: str) -> float:
    speeds = [frame.motors[i - 1].free_speed_mps for i in frame.axis_motors(axis)]
    return sum(speeds) / len(speeds) if speeds else math.inf


def _axis_rolling(frame: Airframe, axis: str) -> float:
    stall = frame.axis_stall_force_n(axis)
    return frame.rolling_force_n / stall if stall else 0.0


def _positive(factor: Array) -> Array:
    return np.maximum(factor, 0.1)
