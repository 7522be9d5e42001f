"""A vehicle on an ideal body: a point mass with the airframe's motors, and both MAVLink ends."""

import math
from dataclasses import replace
from typing import TypeVar

from hil.airframe import motor_forces, pwm_to_output
from hil.faults import GATE, Injection
from hil.mavlink import (
    COMPONENT_GCS,
    Command,
    CommandAck,
    CopterMode,
    Decoder,
    Encoder,
    Message,
    ParamValue,
    Received,
    Result,
    RoverMode,
)
from hil.physics_link import AT_REST_MPS2, PhysicsState
from hil.scenario import Scenario
from sim_vehicles.vehicle import PortName, Vehicle

T = TypeVar("T", bound=Message)
STEP_S = 0.02
STATION, INJECTOR = 250, 251


class Harness:
    """Steps a vehicle; keeps all that was sent on each port, as bytes and as values."""

    def __init__(self, scenario: Scenario, sysid: int = 2) -> None:
        self.vehicle, self.sysid = Vehicle(scenario, sysid), sysid
        self.airframe = scenario.vehicle(sysid).frame
        self.station = Encoder(STATION, COMPONENT_GCS)
        self.injector = Encoder(INJECTOR, COMPONENT_GCS)
        self.ticks = 0
        self.position_m = [0.0, 0.0]
        self.velocity_mps = [0.0, 0.0]
        self.yaw_rad = self.yaw_rate_radps = 0.0
        self.pwm: tuple[int, ...] = (0,) * 16
        self.sent: dict[PortName, list[bytes]] = {"gcs": [], "injector": []}
        self.datagrams: dict[PortName, list[bytes]] = {"gcs": [], "injector": []}

    @property
    def time_s(self) -> float:
        return self.ticks * STEP_S

    def tell(self, datagram: bytes, port: PortName = "gcs") -> list[Received]:
        """Hand a datagram over; returns the answers on that port."""
        self._collect()
        self.sent[port].clear()
        self.vehicle.receive(port, datagram)
        self._collect()
        return self.received(port)

    def inject(self, *numbers: int) -> None:
        self.tell(self.injector.param_set(self.sysid, GATE, 1.0), "injector")
        self.tell(self.injector.inject_failure(self.sysid, *numbers), "injector")

    def inject_all(self, injection: Injection) -> None:
        """The whole sequence; every order must be confirmed."""
        for name, value in injection.parameters:
            self.tell(self.injector.param_set(self.sysid, name, value), "injector")
            assert [p.name for p in self.values(ParamValue, "injector")] == [name]
        for numbers in injection.commands:
            self.tell(self.injector.inject_failure(self.sysid, *numbers), "injector")
            assert [a.result for a in self.values(CommandAck, "injector")] == [Result.ACCEPTED]

    def run(
        self, seconds: float, velocity_mps: tuple[float, float] | None = None, beats: bool = True
    ) -> None:
        """Drive the body; a set-point each 0.1 s and a heartbeat each second, if wanted."""
        for _ in range(round(seconds / STEP_S)):
            if beats and self.ticks % 50 == 0:
                self.vehicle.receive("gcs", self.station.gcs_heartbeat())
            if velocity_mps is not None and self.ticks % 5 == 0:
                ms = round(self.time_s * 1e3)
                setpoint = self.station.velocity_setpoint(self.sysid, ms, *velocity_mps, None)
                self.vehicle.receive("gcs", setpoint)
            self.pwm = self.vehicle.step(self.state())
            self._move()
            self.ticks += 1
        self._collect()

    def guided(self) -> None:
        """Ready, armed and in GUIDED."""
        self.run(1.5)
        self.tell(self.station.arm(self.sysid))
        self.tell(self.station.set_mode(self.sysid, RoverMode.GUIDED))

    def state(self) -> PhysicsState:
        return PhysicsState(
            time_s=self.time_s,
            gyro_radps=(0.0, 0.0, self.yaw_rate_radps),
            accel_body_mps2=AT_REST_MPS2,
            position_m=(self.position_m[0], self.position_m[1], 0.0),
            velocity_mps=(self.velocity_mps[0], self.velocity_mps[1], 0.0),
            attitude_rad=(0.0, 0.0, self.yaw_rad),
        )

    def received(self, port: PortName = "gcs") -> list[Received]:
        """What has been sent on a port since the last `tell` on it."""
        decoder = Decoder()
        return [r for datagram in self.sent[port] for r in decoder.decode(datagram)]

    def values(self, kind: type[T], port: PortName = "gcs") -> list[T]:
        return [r.value for r in self.received(port) if isinstance(r.value, kind)]

    def _collect(self) -> None:
        ports: tuple[PortName, ...] = ("gcs", "injector")
        for port in ports:
            datagrams = self.vehicle.outbox(port)
            self.sent[port] += datagrams
            self.datagrams[port] += datagrams

    def _move(self) -> None:
        """Heading is locked at north; rolling resistance as Coulomb friction."""
        outputs = [pwm_to_output(p) for p in self.pwm[: len(self.airframe.motors)]]
        vx, vy = self.velocity_mps
        fx, fy, _ = motor_forces(self.airframe, outputs, (vx, vy), 0.0)
        mass = self.airframe.mass_kg
        vx, vy = vx + fx / mass * STEP_S, vy + fy / mass * STEP_S
        speed, loss = math.hypot(vx, vy), self.airframe.rolling_force_n / mass * STEP_S
        keep = max(0.0, speed - loss) / speed if speed > 0.0 else 0.0
        self.velocity_mps = [vx * keep, vy * keep]
        self.position_m = [
            p + v * STEP_S for p, v in zip(self.position_m, self.velocity_mps, strict=True)
        ]


class Hovering(Harness):
    """A quadcopter that hangs where it is, whatever its rotors do: on the ground, then at 3 m."""

    HEIGHT_M = 3.0

    def __init__(self, scenario: Scenario, sysid: int = 2) -> None:
        super().__init__(scenario, sysid)
        self.down_m = 0.0

    def guided(self) -> None:
        """Ready, armed, in GUIDED and in the air."""
        self.run(1.5)
        self.tell(self.station.set_mode(self.sysid, CopterMode.GUIDED))
        self.tell(self.station.arm(self.sysid))
        take_off = (Command.NAV_TAKEOFF, 0, 0, 0, math.nan, 0, 0, self.HEIGHT_M)
        self.tell(self.station.command_long(self.sysid, *take_off))
        assert [a.result for a in self.values(CommandAck)] == [Result.ACCEPTED]
        self.down_m = -self.HEIGHT_M
        self.run(2.0)  # until the estimate is up there, too: the take-off is over

    def state(self) -> PhysicsState:
        return replace(super().state(), position_m=(0.0, 0.0, self.down_m))

    def _move(self) -> None:
        """It stays."""
