"""The battery: current from the outputs as commanded, charge, voltage (pure).

A 6-cell lithium battery of 10 Ah. The current follows what is commanded, not what a broken motor
draws: in this testbed motor faults are silent.
"""

from collections.abc import Sequence
from dataclasses import dataclass

CAPACITY_MAH = 10_000.0
FULL_V, EMPTY_V = 25.2, 21.0
RESISTANCE_OHM = 0.02
IDLE_A = 0.6
MOTOR_A = 3.0  # at full output


@dataclass(frozen=True, slots=True)
class BatteryState:
    """Terminal voltage (V), current (A), consumed charge (mAh)."""

    voltage_v: float = FULL_V
    current_a: float = 0.0
    consumed_mah: float = 0.0

    @property
    def remaining_percent(self) -> int:
        return max(0, 100 - int(100.0 * self.consumed_mah / CAPACITY_MAH))


def drain(battery: BatteryState, outputs: Sequence[float], dt_s: float) -> BatteryState:
    """The battery after dt with these motor outputs."""
    current_a = IDLE_A + MOTOR_A * sum(map(abs, outputs))
    consumed = min(CAPACITY_MAH, battery.consumed_mah + current_a * dt_s / 3.6)
    open_v = FULL_V - (FULL_V - EMPTY_V) * consumed / CAPACITY_MAH
    return BatteryState(open_v - RESISTANCE_OHM * current_a, current_a, consumed)
