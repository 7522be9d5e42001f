"""Faults that the world applies, between a vehicle's firmware, which can't know, and its body."""

from dataclasses import replace

from hil.airframe import Airframe
from hil.damage import Damage, GpsDamage, GpsMeans, MotorOutputs, struck
from hil.faults import Injection
from hil.physics_link import PhysicsState

_TRUE = GpsDamage()


class Tampering:
    """What the motors of one vehicle get of its outputs, and what it is told of its motion.

    Rates, acceleration and attitude stay true: position and velocity are what a GPS would tell.
    """

    def __init__(self, airframe: Airframe) -> None:
        self._motors, self._gps = MotorOutputs(airframe), GpsMeans()
        self._damage = Damage.none(airframe)

    def inject(self, injection: Injection, now_s: float) -> None:
        """In effect from now on. Raises ValueError for what can't be, and changes nothing."""
        damage = struck(self._damage, injection, now_s)
        if damage is None:
            raise ValueError(f"the world can't put {injection.commands} in effect")
        self._damage = damage

    def outputs(self, pwm_us: tuple[int, ...], now_s: float) -> tuple[int, ...]:
        """PWM (us) that the motors get; channels beyond them pass."""
        return self._motors.broken(self._damage.motors, pwm_us, now_s)

    def told(self, state: PhysicsState) -> PhysicsState:
        """The state as it goes to the vehicle; call it with every one, in order of time."""
        means = self._gps.at(state, self._damage.gps)
        if self._damage.gps == _TRUE:
            return state
        (n, vn), (e, ve), (d, vd) = means
        return replace(state, position_m=(n, e, d), velocity_mps=(vn, ve, vd))
