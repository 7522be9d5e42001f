"""What a vehicle says of its own faults, of those that are announced (pure)."""

from collections.abc import Iterator

from hil.damage import Damage
from hil.mavlink import Sensor, Severity, StatusText


def unhealthy(damage: Damage) -> Sensor:
    """The bits that are missing in SYS_STATUS.onboard_control_sensors_health."""
    bits = Sensor(0)
    for broken, bit in (
        (any(m.announced for m in damage.motors), Sensor.MOTOR_OUTPUTS),
        (damage.gps.announced, Sensor.GPS),
        (damage.gyro.announced, Sensor.GYRO),
        (damage.accel.announced, Sensor.ACCEL),
    ):
        bits |= bit if broken else Sensor(0)
    return bits


def announcements(before: Damage, after: Damage) -> tuple[StatusText, ...]:
    """Texts for what has become bad, or good again."""
    was, now = dict(_told(before)), dict(_told(after))
    return tuple(
        StatusText(Severity.CRITICAL, f"{name}: failure")
        if told
        else StatusText(Severity.INFO, f"{name}: healthy again")
        for name, told in now.items()
        if told != was[name]
    )


def _told(damage: Damage) -> Iterator[tuple[str, bool]]:
    for i, motor in enumerate(damage.motors, 1):
        yield f"Motor {i}", motor.announced
    for i, esc in enumerate(damage.escs, 1):
        yield f"ESC {i} telemetry", esc.announced
    yield "GPS 1", damage.gps.announced
    yield "Gyro 1", damage.gyro.announced
    yield "Accel 1", damage.accel.announced
