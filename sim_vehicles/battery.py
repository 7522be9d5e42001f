"""The battery: current from the outputs as commanded, charge, voltage (pure).

The pack is the airframe's. The current follows what is commanded, not what a broken motor draws:
in this testbed motor faults are silent.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from hil.airframe import Airframe, Battery, Motor

STANDARD = Battery()


@dataclass(frozen=True, slots=True)
class BatteryState:
    """Terminal voltage (V), current (A), consumed charge (mAh)."""

    voltage_v: float = STANDARD.full_v
    current_a: float = 0.0
    consumed_mah: float = 0.0
    pack: Battery = STANDARD

    @classmethod
    def full(cls, pack: Battery) -> "BatteryState":
        return cls(pack.full_v, pack=pack)

    @property
    def remaining_percent(self) -> int:
        return max(0, 100 - int(100.0 * self.consumed_mah / self.pack.capacity_mah))


def drain(battery: BatteryState, outputs: Sequence[float], dt_s: float) -> BatteryState:
    """The battery after dt with these motor loads (-1..1)."""
    pack = battery.pack
    current_a = pack.idle_a + pack.motor_a * sum(map(abs, outputs))
    consumed = min(pack.capacity_mah, battery.consumed_mah + current_a * dt_s / 3.6)
    open_v = pack.full_v - (pack.full_v - pack.empty_v) * consumed / pack.capacity_mah
    voltage_v = open_v - pack.resistance_ohm * current_a
    return replace(battery, voltage_v=voltage_v, current_a=current_a, consumed_mah=consumed)


def loads(airframe: Airframe, outputs: Sequence[float | None]) -> tuple[float, ...]:
    """Motor outputs as shares of full load (0..1): a rotor has its zero at -1."""
    return tuple(_load(m, u) for m, u in zip(airframe.motors, outputs, strict=True))


def _load(motor: Motor, output: float | None) -> float:
    if output is None:
        return 0.0
    return abs(output) if motor.reversible else (output + 1.0) / 2.0
