"""Set-points: SET_POSITION_TARGET_LOCAL_NED to a target in NED (m, m/s, rad)."""

import math
from collections.abc import Callable

from hil.frames import body_to_ned, wrap_pi
from hil.mavlink import Frame, LocalSetpoint
from sim_vehicles.autopilot import Target
from sim_vehicles.estimator import Estimate
from sim_vehicles.services.service import Handlers, Replies, Request

ABSURD_MPS = 100.0
ABSURD_M = 100_000.0
ABSURD_RAD = 100.0
_BODY_FRAMES = (Frame.BODY_NED, Frame.BODY_OFFSET_NED)


class SetpointService:
    """Hands accepted targets on. There is no answer to a set-point, as MAVLink has none."""

    def __init__(self, estimate: Callable[[], Estimate], accept: Callable[[Target], None]) -> None:
        self._estimate, self._accept = estimate, accept

    def handlers(self) -> Handlers:
        return {LocalSetpoint: self._setpoint}

    def _setpoint(self, request: Request) -> Replies:
        target = to_target(request.value, self._estimate(), request.now_s)
        if target is not None:
            self._accept(target)
        return []


def to_target(setpoint: LocalSetpoint, estimate: Estimate, now_s: float) -> Target | None:
    """The target of a set-point in any of the four local frames; None for what can't be meant.

    As in ArduPilot Rover a position excludes a velocity, and vertical fields are ignored.
    """
    if setpoint.frame not in tuple(Frame) or _absurd(setpoint):
        return None
    in_body = setpoint.frame in _BODY_FRAMES
    yaw_rad = setpoint.yaw_rad
    if yaw_rad is not None:
        yaw_rad = wrap_pi(yaw_rad + (estimate.yaw_rad if in_body else 0.0))
    if setpoint.position_m is not None:
        north, east = _turned(setpoint.position_m, estimate, in_body)
        if setpoint.frame != Frame.LOCAL_NED:
            north, east = north + estimate.position_m[0], east + estimate.position_m[1]
        return Target(now_s, None, (north, east), yaw_rad, setpoint.yaw_rate_radps)
    if setpoint.velocity_mps is not None:
        velocity = _turned(setpoint.velocity_mps, estimate, in_body)
        return Target(now_s, velocity, None, yaw_rad, setpoint.yaw_rate_radps)
    return None


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
