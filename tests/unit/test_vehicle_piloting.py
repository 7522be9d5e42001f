"""A person takes over: joystick and RC override in MANUAL; and points on the globe in GUIDED."""

import pytest
from vehicle_harness import Harness

from hil.frames import ned_to_wgs84
from hil.mavlink import (
    Command,
    CommandAck,
    CommandInt,
    Encoder,
    GlobalSetpoint,
    Heartbeat,
    ManualControl,
    Message,
    RcOverride,
    Result,
    RoverMode,
    StatusText,
)
from hil.scenario import Scenario

PERSON = Encoder(245, 190)
VELOCITY_MASK, POSITION_MASK = 0b110111000111, 0b110111111000


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.guided()
    return harness


def steered(rover: Harness, message: Message, seconds: float) -> None:
    """A person repeats a message each 0.1 s."""
    for _ in range(round(seconds / 0.1)):
        rover.vehicle.receive("gcs", PERSON.encode(message))
        rover.run(0.1)


def globe(rescue: Scenario, north_m: float, east_m: float) -> tuple[float, float]:
    return ned_to_wgs84(north_m, east_m, rescue.origin.origin())


def mode(rover: Harness) -> int:
    rover.run(1.0)
    return rover.values(Heartbeat)[-1].custom_mode


def test_a_joystick_drives_in_manual_only(rover: Harness) -> None:
    forward = ManualControl(2, 0.0, 0.0, 0.5, 0.0)
    steered(rover, forward, 0.5)
    assert abs(rover.velocity_mps[0]) < 0.05
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    steered(rover, forward, 3.0)
    assert rover.velocity_mps[0] > 0.4
    assert rover.pwm[:4] == (1700, 1700, 1500, 1500)


def test_a_takeover_wins_over_set_points(rover: Harness) -> None:
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    for _ in range(10):
        rover.vehicle.receive("gcs", PERSON.encode(ManualControl(2, 0.0, 0.0, -0.5, 0.0)))
        rover.run(0.1, (0.5, 0.0))
    assert rover.velocity_mps[0] < -0.2


def test_rc_override_has_the_same_axes(rover: Harness) -> None:
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    sideways = RcOverride(2, 1, (1500, 65535, 1500, 1750, *(65535,) * 4, *(0,) * 10))
    steered(rover, sideways, 1.0)
    assert rover.pwm[:4] == (1500, 1500, 1700, 1700)
    turn = RcOverride(2, 1, (1750, 65535, 0, 0, *(65535,) * 4, *(0,) * 10))
    steered(rover, turn, 0.2)
    assert sorted(rover.pwm[:4]) == [1300, 1300, 1700, 1700]


def test_letting_go_holds_with_a_text(rover: Harness) -> None:
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    steered(rover, ManualControl(2, None, None, 0.5, None), 1.0)
    rover.run(2.8)
    assert rover.pwm[0] == 1700
    rover.run(0.4)
    assert rover.pwm[0] == 0
    assert "Radio Failsafe: Hold" in [t.text for t in rover.values(StatusText)]
    assert mode(rover) == RoverMode.HOLD


def test_sticks_do_not_wait_for_the_next_manual(rover: Harness) -> None:
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    steered(rover, ManualControl(2, 0.0, 0.0, 1.0, 0.0), 0.5)
    rover.tell(PERSON.set_mode(2, RoverMode.HOLD))
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    rover.run(0.1)
    assert rover.pwm[:4] == (1500,) * 4


def test_a_joystick_for_nobody_or_another_drives_nothing(rover: Harness) -> None:
    rover.tell(PERSON.set_mode(2, RoverMode.MANUAL))
    for target in (0, 3):
        steered(rover, ManualControl(target, 0.0, 0.0, 1.0, 0.0), 0.3)
    assert rover.pwm[:4] == (1500,) * 4


@pytest.mark.parametrize("frame", [0, 3, 5, 6, 10, 11])
def test_a_point_on_the_globe(rescue: Scenario, rover: Harness, frame: int) -> None:
    x, y = rover.position_m
    place = (*globe(rescue, x + 1.0, y - 0.5), 0.0)
    setpoint = GlobalSetpoint(2, 1, 0.0, frame, POSITION_MASK, place, None, None, None)
    rover.tell(rover.station.encode(setpoint))
    rover.run(6.0)
    assert rover.position_m == pytest.approx([x + 1.0, y - 0.5], abs=0.15)


def test_a_velocity_with_the_global_message(rover: Harness) -> None:
    velocity = (0.0, 0.5, 0.0)
    setpoint = GlobalSetpoint(2, 1, 0.0, 6, VELOCITY_MASK, None, velocity, None, None)
    rover.tell(rover.station.encode(setpoint))
    rover.run(2.0)
    assert rover.velocity_mps == pytest.approx([0.0, 0.5], abs=0.1)
    rover.run(2.5)
    assert abs(rover.velocity_mps[1]) < 0.05


@pytest.mark.parametrize(("frame", "lat"), [(1, 47.4), (42, 47.4), (6, 0.0), (6, 200.0)])
def test_places_that_cannot_be_meant_are_dropped(rover: Harness, frame: int, lat: float) -> None:
    setpoint = GlobalSetpoint(2, 1, 0.0, frame, POSITION_MASK, (lat, 8.5, 0.0), None, None, None)
    rover.tell(rover.station.encode(setpoint))
    rover.run(1.0)
    assert abs(rover.velocity_mps[0]) < 0.05


def reposition(rescue: Scenario, point: tuple[float, float], flags: float) -> CommandInt:
    lat, lon = globe(rescue, *point)
    params = (-1.0, flags, 0.0, float("nan"))
    return CommandInt(2, 1, 6, Command.DO_REPOSITION, params, round(lat * 1e7), round(lon * 1e7), 0)


def test_do_reposition(rescue: Scenario, rover: Harness) -> None:
    x, y = rover.position_m
    rover.tell(rover.station.set_mode(2, RoverMode.HOLD))
    for flags, result in ((0.0, Result.DENIED), (1.0, Result.ACCEPTED), (0.0, Result.ACCEPTED)):
        rover.tell(rover.station.encode(reposition(rescue, (x, y + 1.0), flags)))
        assert [a.result for a in rover.values(CommandAck)] == [result]
    rover.run(6.0)
    assert rover.position_m == pytest.approx([x, y + 1.0], abs=0.15)


def test_do_reposition_is_told_apart_from_nonsense(rover: Harness) -> None:
    rover.tell(rover.station.command_long(2, Command.DO_REPOSITION, -1.0, 1.0))
    assert [a.result for a in rover.values(CommandAck)] == [Result.COMMAND_INT_ONLY]
    far = CommandInt(2, 1, 6, Command.DO_REPOSITION, (-1.0, 1.0, 0.0, 0.0), 0, 0, 0.0)
    rover.tell(rover.station.encode(far))
    assert [a.result for a in rover.values(CommandAck)] == [Result.DENIED]
