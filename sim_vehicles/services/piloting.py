"""A person at the sticks: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE, for MANUAL and STABILIZE.

As in ArduPilot Rover steering is MANUAL_CONTROL y and channel 1, throttle z and channel 3; sideways
(omni frames) is r and channel 4. As in Copter roll is y and channel 1, pitch x and channel 2 (less
than 1500 us is forward), throttle z (0 to 1) and channel 3, yaw r and channel 4. Any station may
drive, because who takes over is rarely the one that drove; ArduPilot listens to SYSID_MYGCS alone.
"""

import math
from dataclasses import dataclass, replace

from hil.mavlink import ManualControl, RcOverride, stick
from sim_vehicles.services.service import Handlers, Replies, Request

TIMEOUT_S = 3.0  # RC_OVERRIDE_TIME's default
_ROVER = {"steering": 0, "throttle": 2, "lateral": 3}  # channels from 0
_COPTER = {"lateral": 0, "ahead": 1, "throttle": 2, "steering": 3}
IGNORED_US = 65535


@dataclass(frozen=True, slots=True)
class Sticks:
    """Sticks in -1..1, and when they moved last (s).

    Throttle is forward for what drives; for what flies it is up, and 0 hovers. Lateral is to the
    right (for what flies a tilt), steering clockwise, `ahead` a tilt forward.
    """

    throttle: float = 0.0
    lateral: float = 0.0
    steering: float = 0.0
    ahead: float = 0.0
    moved_s: float = -math.inf

    def are_released(self, now_s: float) -> bool:
        """Whether somebody has been at them, but not in the last 3 s."""
        return self.moved_s > -math.inf and now_s - self.moved_s > TIMEOUT_S


class PilotingService:
    """Holds the sticks."""

    def __init__(self, flies: bool = False) -> None:
        self._flies = flies
        self.sticks = Sticks()
        self.centre()

    def handlers(self) -> Handlers:
        return {ManualControl: self._manual_control, RcOverride: self._override}

    def _manual_control(self, request: Request) -> Replies:
        value: ManualControl = request.value
        if value.target_sysid == 0:
            return []
        ahead, right, turn = value.x or 0.0, value.y or 0.0, value.r or 0.0
        if self._flies:
            lift = 0.0 if value.z is None else max(-1.0, 2.0 * value.z - 1.0)
            self.sticks = Sticks(lift, right, turn, ahead, request.now_s)
        else:
            self.sticks = Sticks(value.z or 0.0, turn, right, moved_s=request.now_s)
        return []

    def _override(self, request: Request) -> Replies:
        """Channels at 65535 stay as they are; any other value that is no pulse releases one.

        A throttle that keeps something in the air is not released to its middle: it stays.
        """
        value: RcOverride = request.value
        moved = {}
        for name, k in (_COPTER if self._flies else _ROVER).items():
            position = stick(value.channels_us[k])
            is_kept = self._flies and name == "throttle" and position is None
            if value.channels_us[k] != IGNORED_US and not is_kept:
                moved[name] = (position or 0.0) * (-1.0 if name == "ahead" else 1.0)
        if moved:
            self.sticks = replace(self.sticks, **moved, moved_s=request.now_s)
        return []

    def centre(self, airborne_s: float | None = None) -> None:
        """Forget the sticks; they are not taken from one mode into the next.

        On the ground the throttle of what flies is at the bottom. In the air (since when, s) it
        hovers, and somebody has to take the sticks within 3 s.
        """
        if not self._flies:
            self.sticks = Sticks()
        elif airborne_s is None:
            self.sticks = Sticks(throttle=-1.0)
        else:
            self.sticks = Sticks(moved_s=airborne_s)
