"""What the speed controllers report (pure).

They report the outputs as they see them: as commanded, so that a broken motor is silent here, too,
unless its fault is announced (`MotorOutputs.told`). A fault of the telemetry itself is what
`EscDamage` says.
"""

from collections.abc import Sequence

from hil.airframe import Airframe, pwm_to_output
from hil.damage import EscDamage
from hil.mavlink import Esc, EscTelemetry
from sim_vehicles.battery import BatteryState, loads

FULL_RPM = 3000  # at full output, without load
REPORTS_HZ = 10.0
WARM_DEGC = 35
_ABSENT = Esc(0, 0.0, 0.0, 0, 0, 0)


def esc_telemetry(
    airframe: Airframe,
    pwm_us: Sequence[int],
    damage: Sequence[EscDamage],
    battery: BatteryState,
    now_s: float,
) -> EscTelemetry:
    """Of the first four motors. The charge is an equal share of what the battery has given."""
    share_mah = round(battery.consumed_mah / max(1, len(damage)))
    escs = []
    shares = loads(airframe, [pwm_to_output(pwm) for pwm in pwm_us[: len(damage)]])
    for share, broken in zip(shares, damage, strict=True):
        rpm, amps = round(broken.gain * share * FULL_RPM), share * battery.pack.motor_a
        count = int(now_s * REPORTS_HZ)
        sound = Esc(rpm, battery.voltage_v, amps, share_mah, WARM_DEGC, count)
        escs.append(_ABSENT if broken.off else sound)
    first, second, third, fourth, *_ = [*escs, *(_ABSENT,) * 4]
    return EscTelemetry((first, second, third, fourth))
