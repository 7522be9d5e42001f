"""Who steers: modes, targets and sticks to motor outputs.

Services and failsafes ask for changes of the autopilot's state; each frame the state becomes a
velocity, and `steer` makes motor outputs of it.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from hil.airframe import mix
from hil.frames import wrap_pi
from hil.mavlink import CopterMode, Message, Result, RoverMode, Severity, StatusText
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
    end_climb,
    set_mode,
)
from sim_vehicles.by_hand import BOTTOM, fly_by_hand
from sim_vehicles.control import Drive, Memory, velocity_towards
from sim_vehicles.copter_modes import mode_of
from sim_vehicles.estimator import Estimate
from sim_vehicles.failsafes import Trip
from sim_vehicles.flying import climb_to, has_landed, land, landing_speed, settle, take_off
from sim_vehicles.mission import HEIGHT_REACHED_M, Air, Surroundings
from sim_vehicles.navigator import Navigator
from sim_vehicles.parameters import Parameters
from sim_vehicles.senses import Senses
from sim_vehicles.sensors import Vector
from sim_vehicles.services.mode import Change
from sim_vehicles.services.piloting import PilotingService
from sim_vehicles.steering import steer
from sim_vehicles.telemetry import LandedState

Outputs = tuple[float | None, ...]


class Helm:
    """The autopilot's state and the controller's memory, and all that changes them.

    `readiness` says what a mode can count on; `tell` sends messages to every station.
    """

    def __init__(
        self,
        drive: Drive,
        senses: Senses,
        navigator: Navigator,
        parameters: Parameters,
        piloting: PilotingService,
        readiness: Callable[[RoverMode], Readiness],
        tell: Callable[[Sequence[Message]], None],
    ) -> None:
        self._drive, self._senses = drive, senses
        self._navigator, self._parameters = navigator, parameters
        self._piloting, self._readiness, self._tell = piloting, readiness, tell
        self._memory = Memory()
        self._now_s = self._idle_since_s = 0.0
        self.autopilot = Autopilot()

    @property
    def ready(self) -> Readiness:
        ready = self._readiness(self.autopilot.mode)
        if not self._navigator.flies or self._memory.airborne:
            return ready
        throttle_up = self._piloting.sticks.throttle > BOTTOM
        return replace(ready, grounded=not self._navigator.takes_off, throttle_up=throttle_up)

    def apply(self, change: Change) -> Result:
        """Put a transition into effect; its texts go to every station."""
        return self._put(change(self.autopilot, self.ready))

    def _put(self, transition: Transition) -> Result:
        if transition.state is self.autopilot and not transition.texts:
            return transition.result
        before, self.autopilot = self.autopilot, transition.state
        if (before.mode, before.armed) != (self.autopilot.mode, self.autopilot.armed):
            self._memory = self._memory.afresh(self._senses.estimate().yaw_rad)
            self._piloting.centre(self._now_s if self._hovers else None)
        if before.armed and not self.autopilot.armed and self._navigator.flies:
            self._navigator.rewind()
        self._tell(transition.texts)
        return transition.result

    def fly_in(self, number: int) -> Result:
        """Change to a mode by its number as a copter; that ends a landing."""
        if number == CopterMode.LAND:
            return self.land()
        mode = mode_of(number)
        if mode is None:
            self._tell((StatusText(Severity.WARNING, f"Mode {number} is not implemented"),))
            return Result.UNSUPPORTED
        result = self.apply(lambda state, ready: set_mode(state, mode, ready))
        if result is Result.ACCEPTED:
            self._memory = replace(self._memory, landing=False)
        return result

    def take_off(self, height_m: float) -> Result:
        """In GUIDED, armed, on the ground: rise to a height above home, here."""
        guided = self.autopilot.armed and self.autopilot.mode is RoverMode.GUIDED
        if not guided or self._memory.airborne or self._senses.home_m is None:
            return Result.FAILED
        north, east, _ = self._senses.estimate().position_m
        down_m = self._senses.home_down_m - height_m
        point = Target(self._now_s, position_m=(north, east), down_m=down_m, lifts=True)
        self._memory = take_off(self._memory)
        self.autopilot = accept_target(self.autopilot, point)
        return Result.ACCEPTED

    def land(self) -> Result:
        if not self._hovers:
            return Result.FAILED
        self.apply(lambda state, ready: set_mode(state, RoverMode.HOLD, ready))
        self._memory = land(self._memory)
        return Result.ACCEPTED

    def check(self, now_s: float, trips: Iterable[Trip]) -> None:
        """Failsafes and time-outs."""
        self._now_s = now_s
        for trip in trips:
            self._check(trip)
        self._check_sticks(now_s)
        self._put(check_target(self.autopilot, now_s))
        self._check_idle(now_s)

    def _check(self, trip: Trip) -> None:
        known, flies = self.autopilot.tripped, self._navigator.flies
        self._put(check(self.autopilot, trip.which, trip.tripped, trip.action, flies))
        if self.autopilot.tripped - known and trip.action is RoverMode.HOLD and self._hovers:
            self._memory = land(self._memory)

    def _check_sticks(self, now_s: float) -> None:
        by_hand, flies = self.autopilot.mode is RoverMode.MANUAL, self._navigator.flies
        released = self._piloting.sticks.are_released(now_s)
        self._put(check_sticks(self.autopilot, released, flies))
        if by_hand and self.autopilot.mode is RoverMode.HOLD and self._hovers:
            self._memory = land(self._memory)

    def _check_idle(self, now_s: float) -> None:
        """What flies does not stay armed on the ground; in AUTO the mission may go on."""
        armed, auto = self.autopilot.armed, self.autopilot.mode is RoverMode.AUTO
        if not (armed and self._navigator.flies) or self._memory.airborne or auto:
            self._idle_since_s = now_s
        elif 0.0 < self._parameters["DISARM_DELAY"] <= now_s - self._idle_since_s:
            self._put(disarm(self.autopilot))

    def navigate(self, around: Surroundings) -> None:
        """In AUTO and RTL the navigator sets the target."""
        mode = self.autopilot.mode if self.autopilot.armed else RoverMode.HOLD
        target, told = self._navigator.steer(mode, around)
        if target is not None:
            self.autopilot = replace(self.autopilot, target=target)
            if target.lifts and not self._memory.airborne:
                self._memory = take_off(self._memory)
        self._tell(told)
        done = mode is RoverMode.AUTO and self._navigator.progress.complete
        if done and self._navigator.flies and not self._memory.airborne:
            self._put(disarm(self.autopilot))

    def air(self) -> Air | None:
        """Where what flies is."""
        if not self._navigator.flies:
            return None
        down_m = self._senses.estimate().position_m[2]
        return Air(down_m, self._senses.home_down_m, not self._memory.airborne)

    def landed_state(self) -> LandedState:
        if not self._memory.airborne:
            return LandedState.ON_GROUND
        return LandedState.LANDING if self._lands else LandedState.IN_AIR

    def outputs(self, dt_s: float) -> Outputs:
        """What the motors shall do: -1..1, or None for no power."""
        estimate, airframe = self._senses.estimate(), self._drive.airframe
        if not (self.autopilot.drives or self._hovers):
            self._memory = settle(self._memory.afresh(estimate.yaw_rad))
            return (None,) * len(airframe.motors)
        if self.autopilot.mode is RoverMode.MANUAL:
            return self._by_hand(estimate, dt_s)
        self._end_climb(estimate)
        velocity = self._aim(estimate, dt_s)
        if self._navigator.flies and self._senses.is_blind:  # level, as Copter lands without GPS
            velocity = (*estimate.velocity_mps[:2], velocity[2])
        outputs, self._memory = steer(self._drive, self._memory, estimate, velocity, dt_s)
        if self._lands and has_landed(self._memory):
            self._memory = settle(self._memory)
            if self.autopilot.mode is not RoverMode.AUTO:  # a mission may go on
                self._put(disarm(self.autopilot))
        return outputs

    def _by_hand(self, estimate: Estimate, dt_s: float) -> Outputs:
        airframe, sticks = self._drive.airframe, self._piloting.sticks
        if airframe.flight is None:
            return mix(airframe, sticks.throttle, sticks.lateral, sticks.steering)
        outputs, self._memory = fly_by_hand(self._drive, self._memory, estimate, sticks, dt_s)
        return outputs

    def _end_climb(self, estimate: Estimate) -> None:
        target = self.autopilot.target
        if target is None or not target.lifts or target.down_m is None:
            return
        if abs(target.down_m - estimate.position_m[2]) <= HEIGHT_REACHED_M:
            self.autopilot = end_climb(self.autopilot, self._now_s)

    @property
    def _hovers(self) -> bool:
        """In the air no mode cuts the rotors."""
        return self.autopilot.armed and self._memory.airborne

    @property
    def _lands(self) -> bool:
        """Coming down: told to, or by AUTO or RTL."""
        target = self.autopilot.target
        return self._memory.landing or (target is not None and target.lands)

    def _aim(self, estimate: Estimate, dt_s: float) -> Vector:
        """The velocity that the target asks for now; turns the heading to hold towards it."""
        target = self.autopilot.target
        sinking_mps = 0.0
        if self._lands:
            height_m = self._senses.home_down_m - estimate.position_m[2]
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
