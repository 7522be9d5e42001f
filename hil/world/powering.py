"""Motor power at start: what a booting firmware puts on its outputs must drive nobody off."""

from collections.abc import Mapping

from hil.airframe import PWM_OFF_US
from hil.scenario import Vehicle

OURS = "testbed"
Pulses = tuple[int, ...]


class Powering:
    """The motors of a foreign firmware stay without power until it has once sent no pulses at all.

    So a person would do it: motor power on when the autopilot is up and disarmed. (ArduPilot's
    rover sends 1000 us on some outputs for seconds while it boots; MOT_SAFE_DISARM = 1 sends none
    when disarmed.)
    """

    def __init__(self, fleet: tuple[Vehicle, ...]) -> None:
        self._waiting = {v.sysid: len(v.frame.motors) for v in fleet if v.autopilot != OURS}

    def outputs(self, pwm_us: Mapping[int, Pulses]) -> dict[int, Pulses]:
        """The same pulses, or none for a vehicle whose motors have no power yet."""
        for sysid in list(self._waiting):
            pulses = pwm_us.get(sysid, (1,))[: self._waiting[sysid]]
            if all(pulse == PWM_OFF_US for pulse in pulses):
                del self._waiting[sysid]
        return {
            sysid: (PWM_OFF_US,) * len(pulses) if sysid in self._waiting else pulses
            for sysid, pulses in pwm_us.items()
        }
