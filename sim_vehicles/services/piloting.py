"""A person at the sticks: MANUAL_CONTROL and RC_CHANNELS_OVERRIDE, for MANUAL mode.

As in ArduPilot Rover steering is MANUAL_CONTROL y and channel 1, throttle z and channel 3; sideways
(omni frames) is r and channel 4. Any station may drive, because who takes over is rarely the one
that drove; ArduPilot listens to SYSID_MYGCS alone.
"""

import math
from dataclasses import dataclass, replace

from hil.mavlink import ManualControl, RcOverride, stick
from sim_vehicles.services.service import Handlers, Replies, Request

TIMEOUT_S = 3.0  # RC_OVERRIDE_TIME's default
STEERING, THROTTLE, LATERAL = 0, 2, 3  # channels from 0
IGNORED_US = 65535


@dataclass(frozen=True, slots=True)
class Sticks:
    """Throttle (forward), lateral (right) and steering (clockwise) in -1..1, and how old (s)."""

    throttle: float = 0.0
    lateral: float = 0.0
    steering: float = 0.0
    moved_s: float = -math.inf

    def are_released(self, now_s: float) -> bool:
        """Whether somebody has been at them, but not in the last 3 s."""
        return self.moved_s > -math.inf and now_s - self.moved_s > TIMEOUT_S


class PilotingService:
    """Holds the sticks."""

    def __init__(self) -> None:
        self.sticks = Sticks()

    def handlers(self) -> Handlers:
        return {ManualControl: self._manual_control, RcOverride: self._override}

    def _manual_control(self, request: Request) -> Replies:
        value: ManualControl = request.value
        if value.target_sysid != 0:
            throttle, lateral, steering = value.z or 0.0, value.r or 0.0, value.y or 0.0
            self.sticks = Sticks(throttle, lateral, steering, request.now_s)
        return []

    def _override(self, request: Request) -> Replies:
        """Channels at 65535 stay as they are; any other value that is no pulse releases one."""
        value: RcOverride = request.value
        named = {"steering": STEERING, "throttle": THROTTLE, "lateral": LATERAL}
        moved = {
            name: stick(value.channels_us[k]) or 0.0
            for name, k in named.items()
            if value.channels_us[k] != IGNORED_US
        }
        if moved:
            self.sticks = replace(self.sticks, **moved, moved_s=request.now_s)
        return []

    def centre(self) -> None:
        """Forget the sticks; they are not taken from one mode into the next."""
        self.sticks = Sticks()
