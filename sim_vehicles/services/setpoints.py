"""Set-points: SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT, MAV_CMD_DO_REPOSITION.

All become a target in NED (m, m/s, rad).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from hil.frames import Origin, body_to_ned, wgs84_to_ned, wrap_pi
from hil.mavlink import (
    Command,
    Frame,
    GlobalFrame,
    GlobalSetpoint,
    LocalSetpoint,
    Result,
    RoverMode,
    TypeMask,
    Vector,
)
from sim_vehicles.autopilot import Autopilot, Readiness, Target, Transition, accept_target, set_mode
from sim_vehicles.estimator import Estimate
from sim_vehicles.services.commands import DENIED, Executor, Order, Outcome
from sim_vehicles.services.mode import Change
from sim_vehicles.services.service import Handlers, Replies, Request

ABSURD_MPS = 100.0
ABSURD_M = 100_000.0
ABSURD_RAD = 100.0
CHANGE_MODE = 1  # MAV_DO_REPOSITION_FLAGS_CHANGE_MODE
_BODY_FRAMES = (Frame.BODY_NED, Frame.BODY_OFFSET_NED)


class SetpointService:
    """Hands accepted targets on. There is no answer to a set-point, as MAVLink has none."""

    def __init__(
        self,
        origin: Origin,
        estimate: Callable[[], Estimate],
        apply: Callable[[Change], Result],
        home_down: Callable[[], float] | None = None,
    ) -> None:
        """`home_down` is where heights count from (NED down, m), for what flies."""
        self._origin, self._estimate, self._apply = origin, estimate, apply
        self._home_down = home_down

    def handlers(self) -> Handlers:
        return {LocalSetpoint: self._local, GlobalSetpoint: self._global}

    def executors(self) -> Mapping[int, Executor]:
        return {Command.DO_REPOSITION: self._reposition}

    def _local(self, request: Request) -> Replies:
        return self._accept(to_target(request.value, self._estimate(), request.now_s))

    def _global(self, request: Request) -> Replies:
        value: GlobalSetpoint = request.value
        down_m = self._down(value.frame, value.position[2]) if value.position else None
        local = to_local(value, self._origin, down_m)
        if local is not None:
            self._accept(to_target(local, self._estimate(), request.now_s))
        return []

    def _accept(self, target: Target | None) -> Replies:
        if target is not None:
            self._apply(lambda state, _ready: Transition(accept_target(state, target)))
        return []

    def _reposition(self, order: Order) -> Outcome:
        """As COMMAND_INT only. Outside GUIDED the flag CHANGE_MODE is needed."""
        if order.frame is None:
            return Outcome(Result.COMMAND_INT_ONLY)
        flags, lat, lon = order.integer(2), order.params[4] / 1e7, order.params[5] / 1e7
        point = _ned(lat, lon, self._origin)
        if order.frame not in tuple(GlobalFrame) or flags is None or point is None:
            return DENIED
        down_m = self._down(order.frame, order.params[6])
        if down_m is not None and abs(down_m) > ABSURD_M:
            return DENIED
        speed = order.params[0] if order.params[0] > 0.0 else None
        target = Target(order.now_s, position_m=point, speed_mps=speed, down_m=down_m)
        return Outcome(
            self._apply(lambda state, ready: reposition(state, ready, target, flags & CHANGE_MODE))
        )

    def _down(self, frame: int, alt_m: float) -> float | None:
        """NED down (m) of an altitude; None for what drives, and to keep the height."""
        if self._home_down is None or math.isnan(alt_m):
            return None
        above_sea = frame in (GlobalFrame.GLOBAL, GlobalFrame.GLOBAL_INT)
        return (self._origin.alt_m if above_sea else self._home_down()) - alt_m


def reposition(state: Autopilot, ready: Readiness, target: Target, change_mode: int) -> Transition:
    """Go to a point in GUIDED, which is entered when the sender allows it."""
    if state.mode is not RoverMode.GUIDED and not change_mode:
        return Transition(state, Result.DENIED)
    guided = set_mode(state, RoverMode.GUIDED, ready)
    return replace(guided, state=accept_target(guided.state, target))


def to_local(
    setpoint: GlobalSetpoint, origin: Origin, down_m: float | None = None
) -> LocalSetpoint | None:
    """The same in local NED, at a height; None for what can't be meant."""
    if setpoint.frame not in tuple(GlobalFrame):
        return None
    place: Vector | None = None
    if setpoint.position is not None:
        point = _ned(setpoint.position[0], setpoint.position[1], origin)
        if point is None:
            return None
        place = (*point, down_m or 0.0)
    s = setpoint
    head = (s.target_sysid, s.target_compid, s.time_s, Frame.LOCAL_NED, s.type_mask)
    return LocalSetpoint(*head, place, s.velocity_mps, s.yaw_rad, s.yaw_rate_radps)


def to_target(setpoint: LocalSetpoint, estimate: Estimate, now_s: float) -> Target | None:
    """The target of a set-point in any of the four local frames; None for what can't be meant.

    As in ArduPilot Rover a position excludes a velocity. Vertical fields are for what flies. A
    position in BODY_NED counts from the vehicle, as ArduPilot has it; MAVLink says from the origin.
    """
    if setpoint.frame not in tuple(Frame) or _absurd(setpoint):
        return None
    in_body = setpoint.frame in _BODY_FRAMES
    yaw_rad = setpoint.yaw_rad
    if yaw_rad is not None:
        yaw_rad = wrap_pi(yaw_rad + (estimate.yaw_rad if in_body else 0.0))
    if setpoint.position_m is not None:
        north, east = _turned(setpoint.position_m, estimate, in_body)
        down: float | None = setpoint.position_m[2]
        if setpoint.frame != Frame.LOCAL_NED:
            north, east = north + estimate.position_m[0], east + estimate.position_m[1]
            down = setpoint.position_m[2] + estimate.position_m[2]
        if setpoint.type_mask & TypeMask.Z:
            down = None
        point = (north, east)
        return Target(now_s, None, point, yaw_rad, setpoint.yaw_rate_radps, down_m=down)
    if setpoint.velocity_mps is not None:
        velocity = _turned(setpoint.velocity_mps, estimate, in_body)
        down = setpoint.velocity_mps[2]
        return Target(now_s, velocity, None, yaw_rad, setpoint.yaw_rate_radps, down_mps=down)
    return None


def _ned(lat_deg: float, lon_deg: float, origin: Origin) -> tuple[float, float] | None:
    """North and east (m) of a point on the globe; None far from here, or for what is no number."""
    if not (abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
        return None
    north, east = wgs84_to_ned(lat_deg, lon_deg, origin)
    return (north, east) if max(abs(north), abs(east)) <= ABSURD_M else None


def _turned(
    vector: tuple[float, float, float], estimate: Estimate, in_body: bool
) -> tuple[float, float]:
    if in_body:
        return body_to_ned(vector[0], vector[1], estimate.yaw_rad)
    return vector[0], vector[1]


def _absurd(setpoint: LocalSetpoint) -> bool:
    angles = (setpoint.yaw_rad or 0.0, setpoint.yaw_rate_radps or 0.0)
    return (
        any(not abs(x) <= ABSURD_M for x in setpoint.position_m or ())
        or any(not abs(v) <= ABSURD_MPS for v in setpoint.velocity_mps or ())
        or any(not math.isfinite(a) or abs(a) > ABSURD_RAD for a in angles)
    )
