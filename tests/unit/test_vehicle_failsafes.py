"""Loss of station, GPS and battery: each acts once, under its name."""

from dataclasses import replace

import pytest
from vehicle_harness import Harness

from hil.mavlink import (
    Command,
    CommandAck,
    FixType,
    GpsRaw,
    Heartbeat,
    Result,
    RoverMode,
    StatusText,
)
from hil.scenario import Scenario
from sim_vehicles.battery import BatteryState
from sim_vehicles.failsafes import Sagging
from sim_vehicles.parameters import rover_parameters

GPS, OFF, OK = 4, 1, 0


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.guided()
    return harness


def texts(rover: Harness) -> list[str]:
    return [t.text for t in rover.values(StatusText)]


def mode(rover: Harness) -> int:
    rover.run(1.0)
    return rover.values(Heartbeat)[-1].custom_mode


def drained(rover: Harness, voltage_v: float) -> None:
    """Put the battery near its end."""
    state = BatteryState(voltage_v, 0.6, 10_000.0 * (25.2 - voltage_v) / 4.2)
    rover.vehicle._battery = state


def test_the_station_falls_silent(rover: Harness) -> None:
    rover.run(5.5, (0.3, 0.0), beats=False)
    assert texts(rover) == ["GCS Failsafe: Hold"]
    rover.run(2.0)
    assert texts(rover)[-1] == "GCS Failsafe Cleared"
    assert mode(rover) == RoverMode.HOLD


def test_gps_loss_holds_refuses_guided_and_clears(rover: Harness) -> None:
    rover.inject(GPS, OFF, 0)
    rover.run(4.0, (0.2, 0.0))
    assert rover.values(GpsRaw)[-1].fix_type == FixType.NO_FIX
    assert "GPS Failsafe: Hold" not in texts(rover)
    rover.run(1.5, (0.2, 0.0))
    assert "GPS Failsafe: Hold" in texts(rover)
    rover.tell(rover.station.set_mode(2, RoverMode.GUIDED))
    assert [a.result for a in rover.values(CommandAck)] == [Result.FAILED]
    rover.inject(GPS, OK, 0)
    rover.run(1.0)
    assert "GPS Failsafe Cleared" in texts(rover)
    rover.tell(rover.station.set_mode(2, RoverMode.GUIDED))
    assert [a.result for a in rover.values(CommandAck)] == [Result.ACCEPTED]


def test_a_person_goes_on_without_gps(rover: Harness) -> None:
    rover.tell(rover.station.set_mode(2, RoverMode.MANUAL))
    rover.inject(GPS, OFF, 0)
    rover.run(6.0)
    assert "GPS Failsafe: Report" in texts(rover)
    assert mode(rover) == RoverMode.MANUAL


@pytest.mark.parametrize(
    ("action", "expected"), [(0, RoverMode.GUIDED), (1, RoverMode.RTL), (2, RoverMode.HOLD)]
)
def test_a_low_battery_acts_after_its_timer(
    rover: Harness, action: int, expected: RoverMode
) -> None:
    for name, value in (("LOW_VOLT", 22.0), ("FS_LOW_ACT", action), ("LOW_TIMER", 3)):
        rover.tell(rover.station.param_set(2, f"BATT_{name}", float(value)))
    drained(rover, 21.8)
    rover.run(2.8)
    assert texts(rover) == []
    rover.run(0.5)
    does = "Report" if action == 0 else expected.name.capitalize()
    assert texts(rover) == [f"Battery Failsafe: {does}"]
    assert mode(rover) == expected


def test_a_critical_battery_has_the_last_word(rover: Harness) -> None:
    settings = {"LOW_VOLT": 22, "CRT_VOLT": 21.5, "FS_LOW_ACT": 1, "FS_CRT_ACT": 2, "LOW_TIMER": 0}
    for name, value in settings.items():
        rover.tell(rover.station.param_set(2, f"BATT_{name}", float(value)))
    drained(rover, 21.2)
    assert mode(rover) == RoverMode.HOLD
    assert texts(rover) == ["Battery Failsafe: Rtl", "Critical Battery Failsafe: Hold"]


def test_a_low_battery_does_not_arm(rover: Harness) -> None:
    rover.tell(rover.station.arm(2, False))
    rover.tell(rover.station.param_set(2, "BATT_LOW_VOLT", 22.0))
    drained(rover, 21.8)
    rover.run(0.1)
    rover.tell(rover.station.arm(2))
    assert texts(rover) == ["Arm: battery below 22.0 V"]
    assert rover.values(CommandAck)[0].command == Command.COMPONENT_ARM_DISARM


def test_a_short_dip_does_not_count(rescue: Scenario) -> None:
    parameters = rover_parameters(2, 250, rescue.vehicle(2).frame)
    parameters.set("BATT_LOW_VOLT", 22.0)
    dipped = Sagging().at(1.0, 21.9, parameters)
    assert dipped == Sagging(low_s=1.0)
    assert dipped.at(5.0, 21.9, parameters) == dipped
    assert replace(dipped).at(6.0, 22.1, parameters) == Sagging()
