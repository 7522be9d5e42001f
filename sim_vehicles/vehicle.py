"""A vehicle: senses, guard, helm, services and ports put together (no I/O, no clock).

A datagram: `receive` -> `ports` -> a service -> `guard` or `helm`. A frame: `step` -> `senses` ->
`guard` -> navigator and `helm` -> PWM, and telemetry of all that to the `ports`. Time is physics
time.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, partial

from hil.airframe import output_to_pwm
from hil.damage import MotorOutputs
from hil.mavlink import HomePosition, Message, MessageId, Severity, Signing, StatusText
from hil.physics_link import PhysicsState, pad_channels
from hil.scenario import Scenario
from sim_vehicles import telemetry
from sim_vehicles.announcing import unhealthy
from sim_vehicles.battery import BatteryState, drain, loads
from sim_vehicles.control import Drive
from sim_vehicles.escs import esc_telemetry
from sim_vehicles.guard import Guard
from sim_vehicles.helm import Helm
from sim_vehicles.mission import Surroundings
from sim_vehicles.navigator import Navigator
from sim_vehicles.parameters import ACCEPT_UNSIGNED, Parameters, rover_parameters
from sim_vehicles.port import Port
from sim_vehicles.ports import PortName, Ports
from sim_vehicles.senses import Senses
from sim_vehicles.sensors import Barometer
from sim_vehicles.services import ftp, time
from sim_vehicles.services.commands import CommandService, Executor
from sim_vehicles.services.failure import FailureService, injection_parameters
from sim_vehicles.services.fence import FenceService
from sim_vehicles.services.flight import FlightService
from sim_vehicles.services.mission import MissionService
from sim_vehicles.services.mode import ModeService
from sim_vehicles.services.parameters import ParameterService
from sim_vehicles.services.piloting import PilotingService
from sim_vehicles.services.service import Handlers, merged
from sim_vehicles.services.setpoints import SetpointService
from sim_vehicles.services.streams import Builder, StreamService, default_rates_hz
from sim_vehicles.telemetry import BUILDERS, Snapshot

__all__ = ["PortName", "Vehicle"]


INJECTOR_LINK = 255  # its number in signatures; stations have those below


class Vehicle:
    """One simulated vehicle. `receive` answers at once into the outbox of the same port.

    `signing_for` makes the signing of a port by its link id; without it nothing is signed.
    """

    def __init__(
        self,
        scenario: Scenario,
        sysid: int,
        signing_for: Callable[[int], Signing] | None = None,
    ) -> None:
        member = scenario.vehicle(sysid)
        self._sysid, self._origin = sysid, scenario.origin.origin()
        self._drive = Drive.of(member.frame, scenario.yaw == "locked")
        barometer = Barometer(scenario.seed, sysid) if member.frame.flight else None
        self._senses = Senses(scenario.sensors, scenario.seed, sysid, barometer)
        self._parameters = rover_parameters(
            sysid, scenario.links.station_sysid, member.frame, signs=signing_for is not None
        )
        self._navigator = Navigator(self._origin, member.frame.flight is not None)
        self._guard = Guard(self._parameters, self._navigator, self._senses)
        self._piloting = PilotingService(member.frame.flight is not None)
        self._helm = Helm(
            self._drive,
            self._senses,
            self._navigator,
            self._parameters,
            self._piloting,
            self._guard.readiness,
            self._tell,
        )
        self._battery = BatteryState.full(member.frame.battery)
        self._outputs = MotorOutputs(member.frame)
        self._now_s: float | None = None
        self._pwm = pad_channels(())
        self._telemetry_hz, self._signing_for = scenario.clock.telemetry_hz, signing_for
        self._failures = FailureService(injection_parameters(), member.frame)
        self._look: Callable[[], Snapshot] = self._snapshot
        self._handlers, self._executors = self._services()
        self._ports = Ports(self._injector_port(), self._station_port)

    def _services(self) -> tuple[Handlers, Mapping[int, Executor]]:
        """What all stations share: who handles a message, who executes a command."""
        helm, senses = self._helm, self._senses
        flies = self._drive.airframe.flight is not None
        home_down = (lambda: senses.home_down_m) if flies else None
        setpoints = SetpointService(self._origin, senses.estimate, helm.apply, home_down)
        modes = ModeService(helm.apply, helm.fly_in if flies else None)
        fence = FenceService(self._parameters, self._navigator)
        self._missions = MissionService(self._navigator, self._origin, self._home, helm.apply)
        flight = FlightService(helm.take_off, helm.land)
        commanded = (modes, setpoints, fence, self._missions, *((flight,) if flies else ()))
        table = ParameterService(self._parameters)
        heard = (self._guard, table, modes, setpoints, self._piloting, self._missions, time, ftp)
        handlers = merged(*(service.handlers() for service in heard))
        return handlers, {k: v for s in commanded for k, v in s.executors().items()}

    def _injector_port(self) -> Port:
        """The one that can break the vehicle: nothing of it is on any other port."""
        beats = StreamService(self._builders(), {MessageId.HEARTBEAT: 1.0})
        commands = CommandService({**beats.executors(), **self._failures.executors()})
        sizes = ParameterService(self._failures.sizes)
        handlers = merged(*(service.handlers() for service in (commands, sizes, time, ftp)))
        signing = self._signing_for(INJECTOR_LINK) if self._signing_for else None
        return Port(self._sysid, handlers, beats, signing, self.hears_unsigned)

    def _station_port(self, peer: int) -> Port:
        """A port for one more station: shared services, streams and signatures of its own."""
        streams = StreamService(self._builders(), default_rates_hz(self._telemetry_hz))
        commands = CommandService({**streams.executors(), **self._executors})
        handlers = merged(self._handlers, commands.handlers(), streams.handlers())
        signing = self._signing_for(peer % INJECTOR_LINK) if self._signing_for else None
        return Port(self._sysid, handlers, streams, signing, self.hears_unsigned)

    @property
    def sysid(self) -> int:
        return self._sysid

    @property
    def time_s(self) -> float:
        """Physics time of the last step."""
        return self._now_s or 0.0

    @property
    def parameters(self) -> Parameters:
        """What a station may set; for whoever keeps them."""
        return self._parameters

    def hears_unsigned(self) -> bool:
        """Whether frames without a signature count (MAV1_OPTIONS); without a key they do."""
        return bool(int(self._parameters["MAV1_OPTIONS"]) & ACCEPT_UNSIGNED)

    def receive(self, port: PortName, datagram: bytes, peer: int = 0) -> None:
        """Handle a datagram now. Bad frames and frames for others change nothing.

        `peer` tells stations apart; one that is new gets a port of its own.
        """
        self._ports.receive(port, datagram, peer, self.time_s)

    def keep(self, peers: Collection[int]) -> None:
        """Forget the stations that are not among these; number 0 stays."""
        self._ports.keep(peers)

    def outbox(self, port: PortName, peer: int = 0) -> list[bytes]:
        """Frames to send on a port since the last call, oldest first."""
        return self._ports.drain(port, peer)

    def step(self, state: PhysicsState) -> tuple[int, ...]:
        """One frame: 16 PWM values (us) for the physics, after motor faults.

        A state that is not newer than the last one changes nothing.
        """
        last_s = state.time_s if self._now_s is None else self._now_s
        if self._now_s is None or state.time_s > last_s:
            self._now_s = state.time_s
            self._frame(state, state.time_s - last_s)
        # motors break after reporting, so that a motor fault is silent unless announced
        return self._outputs.broken(self._failures.active.motors, self._pwm, self.time_s)

    def _frame(self, state: PhysicsState, dt_s: float) -> None:
        self._tell(self._failures.news())
        if self._senses.feel(state, dt_s, self._failures.active):
            self._tell((StatusText(Severity.INFO, "Position estimate ready"),))
        mode, voltage_v = self._helm.autopilot.mode, self._battery.voltage_v
        self._helm.check(state.time_s, self._guard.watch(state.time_s, voltage_v, mode))
        self._tell(self._missions.step(state.time_s))
        self._helm.navigate(self._surroundings(state.time_s))
        outputs = self._helm.outputs(dt_s)
        self._battery = drain(self._battery, loads(self._drive.airframe, outputs), dt_s)
        self._pwm = pad_channels([output_to_pwm(output) for output in outputs])
        self._look = cache(self._snapshot)  # streams of one frame tell of one moment
        self._ports.step(state.time_s)
        self._look = self._snapshot

    def _surroundings(self, now_s: float) -> Surroundings:
        return Surroundings(
            now_s,
            self._senses.estimate().position_m[:2],
            (self._senses.home_m or (0.0, 0.0, 0.0))[:2],
            self._origin,
            self._parameters["WP_RADIUS"],
            self._helm.air(),
            self._parameters["RTL_ALT"] / 100.0 if self._navigator.flies else 0.0,
        )

    def _tell(self, messages: Sequence[Message]) -> None:
        self._ports.tell(messages)

    def _home(self) -> HomePosition | None:
        return telemetry.home_position(self._snapshot())

    def _builders(self) -> dict[int, Builder]:
        return {number: partial(self._build, build) for number, build in BUILDERS.items()}

    def _build(self, build: Callable[[Snapshot], Message | None]) -> Message | None:
        return build(self._look())

    def _snapshot(self) -> Snapshot:
        now_s, airframe = self.time_s, self._drive.airframe
        damage = self._failures.active
        pwm_seen_us = self._outputs.told(damage.motors, self._pwm)
        return Snapshot(
            sysid=self._sysid,
            now_s=now_s,
            origin=self._origin,
            estimate=self._senses.estimate(),
            ready=self._helm.ready.to_arm,
            autopilot=self._helm.autopilot,
            fix=self._senses.fix,
            home_m=self._senses.home_m,
            pwm_us=self._pwm,
            battery=self._battery,
            mission=self._navigator.current(),
            fence=self._guard.fence(),
            inertial=self._senses.sample,
            innovation=self._senses.innovation,
            escs=esc_telemetry(airframe, pwm_seen_us, damage.escs, self._battery, now_s),
            sticks=self._piloting.sticks,
            airframe=airframe,
            landed=self._helm.landed_state(),
            unhealthy=unhealthy(damage),
        )
