"""A vehicle: sensors, estimator, autopilot, control and services put together (no I/O, no clock).

Time is physics time. One `step` is one frame of the autopilot: physics state in, PWM out.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal

from hil.airframe import mix, output_to_pwm
from hil.frames import wrap_pi
from hil.mavlink import (
    CopterMode,
    EscTelemetry,
    FenceStatus,
    Heartbeat,
    HomePosition,
    Message,
    MessageId,
    Result,
    RoverMode,
    Severity,
    Signing,
    StatusText,
)
from hil.physics_link import PhysicsState, pad_channels
from hil.scenario import Scenario
from sim_vehicles import telemetry
from sim_vehicles.autopilot import (
    Autopilot,
    Readiness,
    Target,
    Transition,
    accept_target,
    check,
    check_sticks,
    check_target,
    disarm,
    set_mode,
)
from sim_vehicles.battery import BatteryState, drain, loads
from sim_vehicles.control import Drive, Memory, velocity_towards
from sim_vehicles.copter_modes import mode_of
from sim_vehicles.damage import MotorOutputs
from sim_vehicles.escs import esc_telemetry
from sim_vehicles.estimator import Estimate, Estimator
from sim_vehicles.failsafes import Breaches, Sagging, Signs, Trip, complaints, trips
from sim_vehicles.flying import climb_to, has_landed, land, landing_speed, settle, take_off
from sim_vehicles.innovation import Innovation, innovation
from sim_vehicles.mission import Air, Surroundings
from sim_vehicles.navigator import Navigator
from sim_vehicles.parameters import Parameters, rover_parameters
from sim_vehicles.port import Port
from sim_vehicles.sensors import Gps, GpsFix, Inertial, InertialSensors, Vector
from sim_vehicles.services import ftp, time
from sim_vehicles.services.commands import CommandService
from sim_vehicles.services.failure import FailureService, injection_parameters
from sim_vehicles.services.fence import FenceService
from sim_vehicles.services.flight import FlightService
from sim_vehicles.services.mission import MissionService
from sim_vehicles.services.mode import Change, ModeService
from sim_vehicles.services.parameters import ParameterService
from sim_vehicles.services.piloting import PilotingService
from sim_vehicles.services.service import Replies, Request, merged
from sim_vehicles.services.setpoints import SetpointService
from sim_vehicles.services.streams import Builder, StreamService
from sim_vehicles.steering import steer
from sim_vehicles.telemetry import LandedState, Snapshot

PortName = Literal["gcs", "injector"]
FIX_LOST_AFTER_S = 1.0  # without a fix for so long, telemetry says that there is none
_TELEMETRY: Mapping[MessageId, Callable[[Snapshot], Message | None]] = {
    MessageId.HEARTBEAT: telemetry.heartbeat,
    MessageId.SYS_STATUS: telemetry.sys_status,
    MessageId.GPS_RAW_INT: telemetry.gps_raw,
    MessageId.GLOBAL_POSITION_INT: telemetry.global_position,
    MessageId.LOCAL_POSITION_NED: telemetry.local_position,
    MessageId.ATTITUDE: telemetry.attitude,
    MessageId.SERVO_OUTPUT_RAW: telemetry.servo_outputs,
    MessageId.BATTERY_STATUS: telemetry.battery_status,
    MessageId.EXTENDED_SYS_STATE: telemetry.extended_sys_state,
    MessageId.HOME_POSITION: telemetry.home_position,
    MessageId.GPS_GLOBAL_ORIGIN: telemetry.gps_origin,
    MessageId.MISSION_CURRENT: telemetry.mission_current,
    MessageId.AUTOPILOT_VERSION: telemetry.autopilot_version,
    MessageId.FENCE_STATUS: telemetry.fence_status,
    MessageId.RAW_IMU: telemetry.raw_imu,
    MessageId.SCALED_IMU: telemetry.scaled_imu,
    MessageId.EKF_STATUS_REPORT: telemetry.ekf_status,
    MessageId.ESC_TELEMETRY_1_TO_4: telemetry.esc_telemetry,
    MessageId.VFR_HUD: telemetry.vfr_hud,
    MessageId.RC_CHANNELS: telemetry.rc_channels,
}


def default_rates_hz(telemetry_hz: float) -> dict[int, float]:
    """What streams unprompted on the station's port; all else only when asked for."""
    return {
        MessageId.HEARTBEAT: 1.0,
        MessageId.SYS_STATUS: 1.0,
        MessageId.GPS_RAW_INT: 2.0,
        MessageId.GLOBAL_POSITION_INT: 2.0,
        MessageId.LOCAL_POSITION_NED: telemetry_hz,
        MessageId.ATTITUDE: telemetry_hz,
        MessageId.SERVO_OUTPUT_RAW: 2.0,
        MessageId.BATTERY_STATUS: 0.5,
        MessageId.EXTENDED_SYS_STATE: 1.0,
        MessageId.HOME_POSITION: 0.5,
        MessageId.GPS_GLOBAL_ORIGIN: 0.5,
        MessageId.MISSION_CURRENT: 1.0,
    }


class Vehicle:
    """One simulated rover. `receive` answers at once into the outbox of the same port.

    `signing_for` makes the signing of a station's port; without it nothing is signed.
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
        self._inertial = InertialSensors(scenario.sensors, scenario.seed, sysid)
        self._gps = Gps(scenario.sensors, scenario.seed, sysid)
        self._estimator = Estimator(scenario.sensors)
        self._parameters = rover_parameters(sysid, scenario.links.station_sysid, member.frame)
        self._autopilot = Autopilot()
        self._navigator = Navigator(self._origin, member.frame.flight is not None)
        self._breaches, self._sagging = Breaches(), Sagging()
        self._battery = BatteryState.full(member.frame.battery)
        self._memory = Memory()
        self._outputs = MotorOutputs(member.frame)
        self._now_s: float | None = None
        self._gcs_heard_s: float | None = None
        self._noise = scenario.sensors
        self._sample: Inertial | None = None
        self._innovation = Innovation()
        self._fix: GpsFix | None = None
        self._home_m: Vector | None = None
        self._pwm = pad_channels(())
        self._telemetry_hz, self._signing_for = scenario.clock.telemetry_hz, signing_for
        self._connect()

    def _connect(self) -> None:
        """The services of all stations, and the injector's, which alone can break the vehicle."""
        flies = self._drive.airframe.flight is not None
        home_down = (lambda: (self._home_m or (0.0, 0.0, 0.0))[2]) if flies else None
        setpoints = SetpointService(self._origin, self._estimator.estimate, self._apply, home_down)
        modes = ModeService(self._apply, self._fly_in if flies else None)
        fence = FenceService(self._parameters, self._navigator)
        self._missions = MissionService(self._navigator, self._origin, self._home, self._apply)
        self._piloting = PilotingService()
        table = ParameterService(self._parameters)
        commanded = (modes, setpoints, fence, self._missions)
        self._executors = {k: v for s in commanded for k, v in s.executors().items()}
        if self._drive.airframe.flight:
            self._executors |= FlightService(self._take_off, self._land).executors()
        self._handlers = merged(
            {Heartbeat: self._heard},
            *(s.handlers() for s in (table, modes, setpoints, self._piloting, self._missions)),
            *(module.handlers() for module in (time, ftp)),
        )
        sizes = injection_parameters()
        self._failures = FailureService(sizes, self._drive.airframe)
        beats = StreamService(self._builders(), {MessageId.HEARTBEAT: 1.0})
        injector = merged(
            CommandService({**beats.executors(), **self._failures.executors()}).handlers(),
            ParameterService(sizes).handlers(),
            *(module.handlers() for module in (time, ftp)),
        )
        self._injector = Port(self._sysid, injector, beats)
        self._stations = {0: self._station_port(0)}

    @property
    def sysid(self) -> int:
        return self._sysid

    @property
    def time_s(self) -> float:
        """Physics time of the last step."""
        return self._now_s or 0.0

    def _builders(self) -> dict[int, Builder]:
        return {number: partial(self._build, build) for number, build in _TELEMETRY.items()}

    def _station_port(self, peer: int) -> Port:
        """A port for one more station: shared services, streams and signatures of its own."""
        streams = StreamService(self._builders(), default_rates_hz(self._telemetry_hz))
        commands = CommandService({**streams.executors(), **self._executors})
        handlers = merged(self._handlers, commands.handlers(), streams.handlers())
        signing = self._signing_for(peer) if self._signing_for else None
        return Port(self._sysid, handlers, streams, signing)

    def _port(self, name: PortName, peer: int) -> Port:
        if name == "injector":
            return self._injector
        if peer not in self._stations:
            self._stations[peer] = self._station_port(peer)
        return self._stations[peer]

    @property
    def parameters(self) -> Parameters:
        """What a station may set; for whoever keeps them."""
        return self._parameters

    def receive(self, port: PortName, datagram: bytes, peer: int = 0) -> None:
        """Handle a datagram now. Bad frames and frames for others change nothing.

        `peer` tells stations apart; one that is new gets a port of its own.
        """
        self._port(port, peer).receive(datagram, self._now_s or 0.0)

    def keep(self, peers: Collection[int]) -> None:
        """Forget the stations that are not among these; number 0 stays."""
        for gone in self._stations.keys() - {0, *peers}:
            del self._stations[gone]

    def outbox(self, port: PortName, peer: int = 0) -> list[bytes]:
        """Frames to send on a port since the last call, oldest first."""
        return self._port(port, peer).drain()

    def step(self, state: PhysicsState) -> tuple[int, ...]:
        """One frame: 16 PWM values (us) for the physics, after motor faults.

        A state that is not newer than the last one changes nothing.
        """
        last_s = state.time_s if self._now_s is None else self._now_s
        if self._now_s is None or state.time_s > last_s:
            self._now_s = state.time_s
            dt_s = state.time_s - last_s
            self._sense(state, dt_s)
            self._watch(state.time_s)
            self._navigate(state.time_s)
            self._pwm = self._control(dt_s)
            for port in (*self._stations.values(), self._injector):
                port.step(state.time_s)
        return self._broken(self._pwm)

    def _sense(self, state: PhysicsState, dt_s: float) -> None:
        damage = self._failures.active
        self._sample = self._inertial.sample(state, damage.gyro, damage.accel)
        self._estimator.inertial(self._sample, dt_s)
        fix = self._gps.sample(state, damage.gps)
        if fix is not None:
            self._fix = fix
            self._innovation = innovation(fix, self._estimator.estimate(), self._noise)
            self._estimator.gps(fix)
        elif self._estimator.fix_age_s > FIX_LOST_AFTER_S:
            self._fix = None
        if self._home_m is None and self._estimator.ready:
            self._home_m = self._estimator.estimate().position_m
            self._tell((StatusText(Severity.INFO, "Position estimate ready"),))

    def _watch(self, now_s: float) -> None:
        """Time-outs and failsafes."""
        self._breaches = self._breaches.at(now_s, self._is_outside())
        self._sagging = self._sagging.at(now_s, self._battery.voltage_v, self._parameters)
        signs = self._signs()
        for trip in trips(signs, self._parameters):
            self._check(trip)
        released = self._piloting.sticks.are_released(now_s)
        self._apply(lambda state, _ready: check_sticks(state, released))
        self._apply(lambda state, _ready: check_target(state, now_s))

    def _check(self, trip: Trip) -> None:
        known, flies = self._autopilot.tripped, self._navigator.flies
        self._apply(
            lambda state, _ready: check(state, trip.which, trip.tripped, trip.action, flies)
        )
        if self._autopilot.tripped - known and trip.action is RoverMode.HOLD and self._hovers:
            self._memory = land(self._memory)

    def _signs(self) -> Signs:
        now_s, heard_s = self._now_s or 0.0, self._gcs_heard_s
        return Signs(
            now_s=now_s,
            mode=self._autopilot.mode,
            gcs_silence_s=None if heard_s is None else now_s - heard_s,
            fix_age_s=self._estimator.fix_age_s if self._home_m else None,
            sagging=self._sagging,
            outside=self._breaches.outside,
        )

    def _is_outside(self) -> bool:
        if self._home_m is None or not self._parameters["FENCE_ENABLE"]:
            return False
        here, home = self._estimator.estimate().position_m[:2], self._home_m[:2]
        kinds, radius_m = int(self._parameters["FENCE_TYPE"]), self._parameters["FENCE_RADIUS"]
        return self._navigator.is_outside(here, home, kinds, radius_m)

    def _navigate(self, now_s: float) -> None:
        """In AUTO and RTL the navigator sets the target."""
        self._tell(self._missions.step(now_s))
        around = Surroundings(
            now_s,
            self._estimator.estimate().position_m[:2],
            (self._home_m or (0.0, 0.0, 0.0))[:2],
            self._origin,
            self._parameters["WP_RADIUS"],
            self._air(),
            self._parameters["RTL_ALT"] / 100.0 if self._navigator.flies else 0.0,
        )
        mode = self._autopilot.mode if self._autopilot.armed else RoverMode.HOLD
        target, told = self._navigator.steer(mode, around)
        if target is not None:
            self._autopilot = replace(self._autopilot, target=target)
            if target.lifts and not self._memory.airborne:
                self._memory = take_off(self._memory)
        self._tell(told)
        done = mode is RoverMode.AUTO and self._navigator.progress.complete
        if done and self._navigator.flies and not self._memory.airborne:
            self._apply(lambda state, _ready: disarm(state))

    def _air(self) -> Air | None:
        if not self._navigator.flies:
            return None
        down_m, home_m = self._estimator.estimate().position_m[2], self._home_m
        return Air(down_m, home_m[2] if home_m else 0.0, not self._memory.airborne)

    def _control(self, dt_s: float) -> tuple[int, ...]:
        """PWM as commanded, 16 channels."""
        estimate = self._estimator.estimate()
        if not (self._autopilot.drives or self._hovers):
            self._memory = settle(self._memory.afresh(estimate.yaw_rad))
            self._battery = drain(self._battery, (), dt_s)
            return pad_channels([output_to_pwm(None)] * len(self._drive.airframe.motors))
        if self._autopilot.mode is RoverMode.MANUAL and not self._drive.airframe.flight:
            sticks = self._piloting.sticks
            airframe = self._drive.airframe
            outputs = mix(airframe, sticks.throttle, sticks.lateral, sticks.steering)
        else:
            velocity = self._aim(estimate, dt_s)
            outputs, self._memory = steer(self._drive, self._memory, estimate, velocity, dt_s)
            if self._lands and has_landed(self._memory):
                self._memory = settle(self._memory)
                if self._autopilot.mode is not RoverMode.AUTO:  # a mission may go on
                    self._apply(lambda state, _ready: disarm(state))
        self._battery = drain(self._battery, loads(self._drive.airframe, outputs), dt_s)
        return pad_channels([output_to_pwm(output) for output in outputs])

    @property
    def _hovers(self) -> bool:
        """In the air no mode cuts the rotors."""
        return self._autopilot.armed and self._memory.airborne

    @property
    def _lands(self) -> bool:
        """Coming down: told to, or by AUTO or RTL."""
        target = self._autopilot.target
        return self._memory.landing or (target is not None and target.lands)

    def _take_off(self, height_m: float) -> Result:
        """In GUIDED, armed: rise to a height above home, here."""
        guided = self._autopilot.armed and self._autopilot.mode is RoverMode.GUIDED
        if not guided or self._home_m is None:
            return Result.FAILED
        north, east, _ = self._estimator.estimate().position_m
        point = Target(self.time_s, position_m=(north, east), down_m=self._home_m[2] - height_m)
        self._memory = take_off(self._memory)
        self._autopilot = accept_target(self._autopilot, point)
        return Result.ACCEPTED

    def _land(self) -> Result:
        if not self._hovers:
            return Result.FAILED
        self._apply(lambda state, ready: set_mode(state, RoverMode.HOLD, ready))
        self._memory = land(self._memory)
        return Result.ACCEPTED

    def _fly_in(self, number: int) -> Result:
        """Change to a mode by its number as a copter; that ends a landing."""
        if number == CopterMode.LAND:
            return self._land()
        mode = mode_of(number)
        if mode is None:
            self._tell((StatusText(Severity.WARNING, f"Mode {number} is not implemented"),))
            return Result.UNSUPPORTED
        result = self._apply(lambda state, ready: set_mode(state, mode, ready))
        if result is Result.ACCEPTED:
            self._memory = replace(self._memory, landing=False)
        return result

    def _aim(self, estimate: Estimate, dt_s: float) -> Vector:
        """The velocity that the target asks for now; turns the heading to hold towards it."""
        target = self._autopilot.target
        sinking_mps = 0.0
        if self._lands:
            height_m = (self._home_m or (0.0, 0.0, 0.0))[2] - estimate.position_m[2]
            sinking_mps = landing_speed(self._drive.airframe, height_m)
        if target is None or self._memory.landing:
            return 0.0, 0.0, sinking_mps
        if target.yaw_rad is not None:
            self._memory = replace(self._memory, yaw_rad=target.yaw_rad)
        elif target.yaw_rate_radps is not None:
            yaw_rad = wrap_pi(self._memory.yaw_rad + target.yaw_rate_radps * dt_s)
            self._memory = replace(self._memory, yaw_rad=yaw_rad)
        down_mps = sinking_mps if target.lands else target.down_mps
        if target.down_m is not None:
            down_mps = climb_to(self._drive.airframe, estimate, target.down_m)
        if target.position_m is not None:
            limit_mps = min(self._parameters["WP_SPEED"], target.speed_mps or math.inf)
            to = velocity_towards(target.position_m, estimate, limit_mps)
            return (*to, down_mps)
        return (*(target.velocity_mps or (0.0, 0.0)), down_mps)

    def _broken(self, pwm_us: tuple[int, ...]) -> tuple[int, ...]:
        """What the motors get: after reporting, so that a motor fault is silent."""
        return self._outputs.broken(self._failures.active.motors, pwm_us, self._now_s or 0.0)

    def _apply(self, change: Change) -> Result:
        transition: Transition = change(self._autopilot, self._readiness())
        before, self._autopilot = self._autopilot, transition.state
        if (before.mode, before.armed) != (self._autopilot.mode, self._autopilot.armed):
            self._memory = self._memory.afresh(self._estimator.estimate().yaw_rad)
            self._piloting.centre()
        self._tell(transition.texts)
        return transition.result

    def _readiness(self) -> Readiness:
        signs = self._signs()
        placed = self._estimator.ready and not signs.gps_lost
        told = complaints(signs, self._parameters)
        return Readiness(placed, self._navigator.has_mission, told)

    def _home(self) -> HomePosition | None:
        return telemetry.home_position(self._snapshot())

    def _heard(self, request: Request) -> Replies:
        if request.sysid == self._parameters["SYSID_MYGCS"]:
            self._gcs_heard_s = request.now_s
        return []

    def _tell(self, messages: Sequence[Message]) -> None:
        """To every station; the injector gets the texts."""
        if messages:
            for port in self._stations.values():
                port.send(messages)
            self._injector.send(m for m in messages if isinstance(m, StatusText))

    def _landed_state(self) -> LandedState:
        if not self._memory.airborne:
            return LandedState.ON_GROUND
        return LandedState.LANDING if self._lands else LandedState.IN_AIR

    def _build(self, build: Callable[[Snapshot], Message | None]) -> Message | None:
        return build(self._snapshot())

    def _snapshot(self) -> Snapshot:
        now_s = self._now_s or 0.0
        return Snapshot(
            sysid=self._sysid,
            now_s=now_s,
            origin=self._origin,
            estimate=self._estimator.estimate(),
            ready=self._readiness().to_arm,
            autopilot=self._autopilot,
            fix=self._fix,
            home_m=self._home_m,
            pwm_us=self._pwm,
            battery=self._battery,
            mission=self._navigator.current(),
            fence=self._fence(),
            inertial=self._sample,
            innovation=self._innovation,
            escs=self._escs(now_s),
            sticks=self._piloting.sticks,
            flies=self._drive.airframe.flight is not None,
            landed=self._landed_state(),
        )

    def _escs(self, now_s: float) -> EscTelemetry:
        damage, airframe = self._failures.active.escs, self._drive.airframe
        return esc_telemetry(airframe, self._pwm, damage, self._battery, now_s)

    def _fence(self) -> FenceStatus | None:
        return self._breaches.status() if self._parameters["FENCE_ENABLE"] else None
