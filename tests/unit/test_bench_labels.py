"""The names that right verdicts have."""

import pytest

from hil.airframe import AIRFRAMES
from hil.bench.labels import expected_hypothesis
from hil.faults import Fault, Type, Unit

FRAME = AIRFRAMES["omni_plus"]
X, Y = FRAME.axis_motors("x"), FRAME.axis_motors("y")


@pytest.mark.parametrize(
    ("faults", "name"),
    [
        ([], "none"),
        ([Fault(Unit.MOTOR, Type.OFF, X)], "motor_x_off"),
        ([Fault(Unit.MOTOR, Type.OFF, Y)], "motor_y_off"),
        (
            [Fault(Unit.MOTOR, Type.OFF, (Y[0],)), Fault(Unit.MOTOR, Type.OFF, (Y[1],))],
            "motor_y_off",
        ),
        ([Fault(Unit.MOTOR, Type.PARTIAL, Y, size=(0.4,))], "motor_y_partial"),
        ([Fault(Unit.MOTOR, Type.PARTIAL, Y, size=(0.0,))], "motor_y_off"),
        ([Fault(Unit.MOTOR, Type.REVERSED, X)], "motor_x_reversed"),
        ([Fault(Unit.MOTOR, Type.LOCKED, X)], "motor_x_locked"),
        ([Fault(Unit.GPS, Type.STUCK, axes=("north",))], "gps_north_stuck"),
        ([Fault(Unit.GPS, Type.STUCK, axes=("east", "down"))], "gps_east_stuck"),
        ([Fault(Unit.GPS, Type.STUCK)], "gps_stuck"),
        ([Fault(Unit.GPS, Type.REPEAT)], "gps_stuck"),
        ([Fault(Unit.GPS, Type.OFFSET, size=(1.0, 0.0, 0.0))], "gps_offset"),
        ([Fault(Unit.GPS, Type.DRIFT, size=(0.1, 0.0, 0.0))], "gps_drift"),
        ([Fault(Unit.GPS, Type.DELAY, size=(0.5,))], "gps_delay"),
        ([Fault(Unit.GPS, Type.NOISE, size=(0.5,))], "gps_noise"),
    ],
)
def test_what_the_station_knows_has_its_name(faults: list[Fault], name: str) -> None:
    assert expected_hypothesis(faults, FRAME) == name


@pytest.mark.parametrize(
    "faults",
    [
        [Fault(Unit.MOTOR, Type.OFF, (1,))],
        [Fault(Unit.MOTOR, Type.OFF)],  # all four: no axis
        [Fault(Unit.MOTOR, Type.STUCK, Y)],
        [Fault(Unit.GPS, Type.OFF)],
        [Fault(Unit.GPS, Type.STUCK, axes=("down",))],
        [Fault(Unit.GYRO, Type.NOISE, size=(1.0,))],
        [Fault(Unit.MOTOR, Type.OFF, Y), Fault(Unit.GPS, Type.STUCK)],
        [
            Fault(Unit.MOTOR, Type.PARTIAL, (Y[0],), size=(0.2,)),
            Fault(Unit.MOTOR, Type.PARTIAL, (Y[1],), size=(0.8,)),
        ],
    ],
)
def test_what_it_does_not_know_is_something_else(faults: list[Fault]) -> None:
    assert expected_hypothesis(faults, FRAME) == "unknown"
