"""The real ArduPilot rover in our world, where ARDUROVER names its simulator."""

from pathlib import Path

import pytest
import yaml
from worlds import firmware_world

from base_station.identify.process import identify
from hil.bench.firmware.ardupilot import BINARY, binary
from hil.scenario import Scenario

pytestmark = [
    pytest.mark.ardupilot,
    pytest.mark.skipif(binary() is None, reason=f"{BINARY} names no ardurover built for SITL"),
]


def lone_rover() -> Scenario:
    tree = {
        "name": "lone_rover",
        "arena": {"north_min_m": -20, "north_max_m": 20, "east_min_m": -20, "east_max_m": 20},
        "yaw": "free",
        "fleet": [
            {
                "name": "rover_1",
                "sysid": 1,
                "airframe": "skid_steer",
                "autopilot": "ardupilot",
                "start": {"north_m": 3.0, "east_m": -2.0},
                "goal": {"north_m": 6.0, "east_m": 0.0},
            }
        ],
    }
    return Scenario.model_validate(tree)


def fleet_file(scenario: Scenario, path: Path) -> Path:
    base = scenario.links.mavlink_port_base
    assert base is not None
    vehicles = [
        {
            "name": v.name,
            "sysid": v.sysid,
            "connection": f"udpin:127.0.0.1:{base + 10 * i}",
            "airframe": v.airframe,
            "autopilot": v.autopilot,
            "goal": v.goal.model_dump(),
        }
        for i, v in enumerate(scenario.fleet)
    ]
    tree = {
        "origin": scenario.origin.model_dump(),
        "arena": scenario.arena.model_dump(),
        "safety": {"allow_contact": False},
        "fleet": vehicles,
    }
    path.write_text(yaml.safe_dump(tree))
    return path


def test_it_is_waited_for_armed_driven_and_identified(tmp_path: Path) -> None:
    """EKF, settings read back, arming with default checks, GUIDED; the fit halves the residual."""
    with firmware_world(lone_rover(), tmp_path) as scenario:
        stored = identify(fleet_file(scenario, tmp_path / "fleet.yaml"), None)
    found = yaml.safe_load(stored.read_text())["identified"]["rover_1"]["axes"]["x"]
    assert found["model"] == "first_order"
    assert found["residual_m"] <= 0.5 * found["nominal_residual_m"]
