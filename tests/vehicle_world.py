"""Vehicles in the world, without a station: lockstep in memory, both MAVLink ends in hand."""

from collections.abc import Mapping
from typing import Any, TypeVar

from hil.faults import Injection
from hil.mavlink import (
    COMPONENT_AUTOPILOT,
    COMPONENT_GCS,
    CommandAck,
    CopterMode,
    Decoder,
    Encoder,
    Frame,
    LocalPosition,
    LocalSetpoint,
    Message,
    ParamValue,
    Result,
    RoverMode,
)
from hil.physics_link import PhysicsState, ServoFrame, decode_state, encode_frame
from hil.scenario import Scenario
from hil.world.simulation import Simulation
from hil.world.truth import VehicleTruth
from sim_vehicles.vehicle import PortName, Vehicle

T = TypeVar("T", bound=Message)
Velocity = tuple[float, float, float]
SYSID = 1
VELOCITY_ALONE = 3527
EXACT_PLANT = {"motor_gain_sigma": 0, "mass_sigma": 0, "rolling_sigma": 0}


def scenario(airframe: str = "omni_plus", **changes: Any) -> Scenario:
    """One vehicle in the middle of a 200 m square, heading free, plant as on the data sheet."""
    here = {"north_m": 0.0, "east_m": 0.0}
    vehicle = {"name": "one", "sysid": SYSID, "airframe": airframe, "start": here, "goal": here}
    arena = {"north_min_m": -100, "north_max_m": 100, "east_min_m": -100, "east_max_m": 100}
    tree = {"name": "one", "arena": arena, "fleet": [vehicle], "plant": EXACT_PLANT, "yaw": "free"}
    return Scenario.model_validate(tree | changes)


class InWorld:
    """Steps world and vehicles; keeps what was sent on each port since the last `clear`."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario, self.simulation = scenario, Simulation(scenario, scenario.seed)
        self.vehicles = {v.sysid: Vehicle(scenario, v.sysid) for v in scenario.fleet}
        self.station = Encoder(scenario.links.station_sysid, COMPONENT_GCS)
        self.injector = Encoder(scenario.links.injector_sysid, COMPONENT_GCS)
        self.pwm: dict[int, tuple[int, ...]] = dict.fromkeys(self.vehicles, (0,) * 16)
        self.states: dict[int, PhysicsState] = {}
        self.values: dict[tuple[int, PortName], list[Message]] = {}
        self.frames = 0
        self.clear()

    @property
    def time_s(self) -> float:
        return self.simulation.time_s

    def clear(self) -> None:
        self.values = {(s, p): [] for s in self.vehicles for p in ("gcs", "injector")}

    def sent(self, kind: type[T], sysid: int = SYSID, port: PortName = "gcs") -> list[T]:
        return [v for v in self.values[sysid, port] if isinstance(v, kind)]

    def truth(self, sysid: int = SYSID) -> VehicleTruth:
        return self.simulation.world.truth().vehicles[sysid]

    def reported(self, sysid: int = SYSID) -> LocalPosition:
        return self.sent(LocalPosition, sysid)[-1]

    def tell(self, datagram: bytes, sysid: int = SYSID, port: PortName = "gcs") -> None:
        self.vehicles[sysid].receive(port, datagram)
        self._collect(sysid)

    def inject(self, injection: Injection, sysid: int = SYSID) -> None:
        """The whole sequence; every order must be confirmed."""
        for name, value in injection.parameters:
            self.values[sysid, "injector"].clear()
            self.tell(self.injector.param_set(sysid, name, value), sysid, "injector")
            assert [p.name for p in self.sent(ParamValue, sysid, "injector")] == [name]
        for numbers in injection.commands:
            self.values[sysid, "injector"].clear()
            self.tell(self.injector.inject_failure(sysid, *numbers), sysid, "injector")
            acks = self.sent(CommandAck, sysid, "injector")
            assert [a.result for a in acks] == [Result.ACCEPTED], numbers

    def guided(self) -> None:
        """Everybody ready, armed and in GUIDED."""
        self.run(1.5)
        for sysid in self.vehicles:
            flies = self.scenario.vehicle(sysid).frame.flight
            mode = CopterMode.GUIDED if flies else RoverMode.GUIDED
            self.tell(self.station.set_mode(sysid, mode), sysid)
            self.tell(self.station.arm(sysid), sysid)

    def run(self, seconds: float, velocities: Mapping[int, Velocity] | None = None) -> None:
        """With a set-point (NED, m/s) each 0.1 s for those named, and heartbeats for all."""
        for _ in range(round(seconds * self.scenario.clock.autopilot_hz)):
            for sysid in self.vehicles:
                if self.frames % 50 == 0:
                    self.tell(self.station.gcs_heartbeat(), sysid)
                if self.frames % 5 == 0 and sysid in (velocities or {}):
                    self.tell(self._setpoint(sysid, (velocities or {})[sysid]), sysid)
            self._frame()

    def _setpoint(self, sysid: int, velocity_mps: Velocity) -> bytes:
        setpoint = LocalSetpoint(
            target_sysid=sysid,
            target_compid=COMPONENT_AUTOPILOT,
            time_s=self.time_s,
            frame=Frame.LOCAL_NED,
            type_mask=VELOCITY_ALONE,
            position_m=None,
            velocity_mps=velocity_mps,
            yaw_rad=None,
            yaw_rate_radps=None,
        )
        return self.station.encode(setpoint)

    def _frame(self) -> None:
        hz = self.scenario.clock.autopilot_hz
        for sysid in self.vehicles:
            frame = encode_frame(ServoFrame(hz, self.frames, self.pwm[sysid]))
            self.simulation.receive(sysid, [frame], self.time_s)
        self.frames += 1
        for sysid, reply in self.simulation.advance(float("inf"), self.time_s).replies:
            state = decode_state(reply)
            assert state is not None
            self.states[sysid] = state
            self.pwm[sysid] = self.vehicles[sysid].step(state)
            self._collect(sysid)

    def _collect(self, sysid: int) -> None:
        ports: tuple[PortName, ...] = ("gcs", "injector")
        for port in ports:
            for datagram in self.vehicles[sysid].outbox(port):
                decoded = Decoder().decode(datagram)
                values = self.values[sysid, port]
                values += [r.value for r in decoded if isinstance(r.value, Message)]
