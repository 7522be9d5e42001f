"""What motors get of what was commanded (pure but for the outputs it keeps)."""

from collections.abc import Sequence

from hil.airframe import PWM_LOCKED_US, PWM_OFF_US, Airframe, clip_pwm
from hil.damage.state import MotorDamage


class MotorOutputs:
    """Between autopilot and motors: what the motors get of what was commanded, and reported."""

    def __init__(self, airframe: Airframe) -> None:
        self._airframe = airframe
        self._sound = (MotorDamage(),) * len(airframe.motors)
        self._last: tuple[int, ...] = (PWM_OFF_US,) * len(airframe.motors)
        self._held: dict[int, int] = {}

    def broken(
        self, motors: Sequence[MotorDamage], pwm_us: tuple[int, ...], now_s: float
    ) -> tuple[int, ...]:
        """PWM (us) for the physics; channels beyond the motors pass."""
        if motors == self._sound:
            self._held.clear()
            self._last = pwm_us[: len(self._sound)]
            return pwm_us
        out = tuple(self._one(i, m, pwm_us[i], now_s) for i, m in enumerate(motors))
        self._last = out
        return (*out, *pwm_us[len(out) :])

    def told(self, motors: Sequence[MotorDamage], pwm_us: tuple[int, ...]) -> tuple[int, ...]:
        """PWM (us) as the speed controllers see it.

        As commanded, since a fault that is silent acts behind them; one that is announced acts on
        what they see.
        """
        seen = zip(motors, pwm_us, self._last, strict=False)
        return tuple(got if m.announced else commanded for m, commanded, got in seen)

    def _one(self, i: int, motor: MotorDamage, pwm_us: int, now_s: float) -> int:
        if motor.held:
            pwm_us = self._held.setdefault(i, self._last[i])
        else:
            self._held.pop(i, None)
        if motor.locked:
            return PWM_LOCKED_US
        if motor.off or (motor.gaps is not None and motor.gaps.missing(now_s)):
            return PWM_OFF_US
        if motor.gain == 1.0 or pwm_us == PWM_OFF_US:
            return pwm_us
        zero_us = self._airframe.motors[i].zero_us
        return clip_pwm(round(zero_us + motor.gain * (pwm_us - zero_us)))
