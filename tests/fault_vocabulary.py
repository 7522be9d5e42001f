"""One fault of every kind there is, in a size that shows; whoever adds a kind adds it here."""

from hil.faults import Fault, Type, Unit

EXAMPLES: dict[tuple[Unit, Type], Fault] = {
    (f.unit, f.type): f
    for f in (
        Fault(Unit.MOTOR, Type.OFF, (1, 2)),
        Fault(Unit.MOTOR, Type.LOCKED, (1, 2)),
        Fault(Unit.MOTOR, Type.PARTIAL, (1, 2), size=(0.5,)),
        Fault(Unit.MOTOR, Type.REVERSED, (1, 2)),
        Fault(Unit.MOTOR, Type.STUCK, (1, 2)),
        Fault(Unit.MOTOR, Type.INTERMITTENT, (1, 2), size=(2.0, 0.6)),
        Fault(Unit.ESC, Type.OFF, (1,)),
        Fault(Unit.ESC, Type.WRONG, (1,), size=(0.25,)),
        Fault(Unit.GPS, Type.OFF),
        Fault(Unit.GPS, Type.STUCK, axes=("north",)),
        Fault(Unit.GPS, Type.REPEAT),
        Fault(Unit.GPS, Type.OFFSET, size=(3.0, -2.0, 0.0)),
        Fault(Unit.GPS, Type.GLITCH, size=(0.3, 0.0, 0.0)),
        Fault(Unit.GPS, Type.DRIFT, size=(0.2, 0.0, 0.0)),
        Fault(Unit.GPS, Type.NOISE, size=(1.0,)),
        Fault(Unit.GPS, Type.DELAY, size=(1.5,)),
        Fault(Unit.GPS, Type.INTERMITTENT, size=(4.0, 0.6)),
        Fault(Unit.GYRO, Type.BIAS, size=(0.0, 0.0, 0.3)),
        Fault(Unit.GYRO, Type.NOISE, size=(0.5,)),
        Fault(Unit.ACCEL, Type.BIAS, size=(2.0, 0.0, 0.0)),
        Fault(Unit.ACCEL, Type.NOISE, size=(2.0,)),
    )
}
