"""The real ArduPilot rover in our world, where ARDUROVER names its simulator."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from worlds import firmware_world

from base_station.identify.process import identify
from hil.bench.firmware.ardupilot import BINARY, binary
from hil.lifeline import dying_with_parent
from hil.scenario import Scenario

HIL = (sys.executable, "-m", "hil.cli")

pytestmark = [
    pytest.mark.ardupilot,
    pytest.mark.skipif(binary() is None, reason=f"{BINARY} names no ardurover built for SITL"),
]


def descendants(pid: int) -> dict[int, str]:
    """Command lines of all processes below one, by process id."""
    found: dict[int, str] = {}
    for thread in Path(f"/proc/{pid}/task").iterdir():
        for below in map(int, (thread / "children").read_text().split()):
            found[below] = Path(f"/proc/{below}/cmdline").read_bytes().decode()
            found |= descendants(below)
    return found


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
    assert found["model"] == "heading_first"
    assert found["residual_m"] <= 0.5 * found["nominal_residual_m"]


@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", ["three_rovers_dead_drive", "mixed_dead_drive"])
def test_a_dead_drive_is_found(name: str, tmp_path: Path) -> None:
    """`hil run`: EKF, arming, probe, doubt, experiment and the right verdict; then no orphan."""
    file = Path(__file__).with_name(f"{name}.yaml")
    argv = (*HIL, "run", str(file), "--out", str(tmp_path / "run"), "--speed", "4")
    with subprocess.Popen(argv, stdout=subprocess.PIPE, preexec_fn=dying_with_parent()) as run:
        assert run.stdout is not None
        try:
            verdict = next((line for line in run.stdout if b"= rover_2:" in line), b"none")
            firmware = [pid for pid, argv in descendants(run.pid).items() if "ardurover" in argv]
        finally:
            run.terminate()
    assert b"rover_2: motor_x_off" in verdict
    assert firmware
    assert not any(Path(f"/proc/{pid}").exists() for pid in firmware)
