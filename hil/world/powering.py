"""Motor power of a foreign firmware: what it puts out while disarmed drives nobody off."""

from collections.abc import Mapping

from hil.airframe import PWM_OFF_US
from hil.scenario import Vehicle

OURS = "testbed"
Pulses = tuple[int, ...]


class Powering:
    """While one motor of a foreign firmware gets no pulses, none of its motors has power.

    ArduPilot's simulated rover never puts less than 1000 us on outputs 1 and 3, not even with
    MOT_SAFE_DISARM = 1, which means no pulses; outputs 2 and 4 tell whether it is disarmed.
    """

    def __init__(self, fleet: tuple[Vehicle, ...]) -> None:
        self._motors = {v.sysid: len(v.frame.motors) for v in fleet if v.autopilot != OURS}

    def outputs(self, pwm_us: Mapping[int, Pulses]) -> dict[int, Pulses]:
        """The same pulses, or none for a vehicle that is disarmed."""
        return {sysid: self._powered(sysid, pulses) for sysid, pulses in pwm_us.items()}

    def _powered(self, sysid: int, pulses: Pulses) -> Pulses:
        disarmed = PWM_OFF_US in pulses[: self._motors.get(sysid, 0)]
        return (PWM_OFF_US,) * len(pulses) if disarmed else pulses
