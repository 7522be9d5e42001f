"""The real ArduPilot rover in our world, where ARDUROVER names its simulator."""

import select
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from worlds import SPEED, firmware_world

from base_station.identify.process import identify
from hil.bench.firmware.ardupilot import BINARY, binary
from hil.bench.injector import Breaker
from hil.lifeline import dying_with_parent
from hil.link import UdpLink
from hil.scenario import FaultModel, Scenario

HIL = (sys.executable, "-m", "hil.cli")
ABLE = {  # what a scenario of such a fleet wants, as in docs/real-vehicles.md
    "diagnosis": {"evidence": "position_and_fixes"},
    "planning": {"mission": "nose_first", "planner": "cem", "beta_horizon_s": 60.0},
    "limits": {"probe_pulse_s": 1.5},
}

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


def run(scenario: Path, out: Path) -> tuple[int, str, list[int]]:
    """`hil run` to its end: exit code, what it said, process ids of the firmware it had started."""
    argv = (*HIL, "run", str(scenario), "--out", str(out), "--speed", SPEED)
    said: list[str] = []
    firmware: list[int] = []
    with subprocess.Popen(
        argv, stdout=subprocess.PIPE, text=True, preexec_fn=dying_with_parent()
    ) as process:
        assert process.stdout is not None
        for line in process.stdout:
            said.append(line)
            if "armed" in line and not firmware:
                below = descendants(process.pid)
                firmware = [pid for pid, argv in below.items() if "ardurover" in argv]
    return process.returncode, "".join(said), firmware


FIRMWARE_MAKES: tuple[dict[str, Any], ...] = (
    {"unit": "gps", "type": "off"},
    {"unit": "gps", "type": "offset", "size": (2.0, -1.0, 0.5)},
    {"unit": "gps", "type": "delay", "size": (0.4,)},
    {"unit": "accel", "type": "bias", "size": (0.1, 0.2, 0.3)},
    {"unit": "gyro", "type": "bias", "size": (0.01, 0.02, 0.03), "instances": (1,)},
)


def test_it_echoes_every_parameter_of_a_fault_that_it_makes_itself(tmp_path: Path) -> None:
    """A name that it does not know would not be answered."""
    faults = [FaultModel(vehicle=1, **fault) for fault in FIRMWARE_MAKES]
    struck: list[FaultModel] = []
    mended: list[FaultModel] = []
    with firmware_world(lone_rover(), tmp_path) as scenario:
        assert scenario.links.injector_port_base is not None
        link = UdpLink.bind(scenario.links.host, scenario.links.injector_port_base)
        breaker = Breaker(scenario, struck.append, mended.append, lambda _: None)
        try:
            for ask in (breaker.strike, breaker.mend):
                ask(faults)
                while not breaker.done:
                    for datagram in breaker.step(time.monotonic(), 1, link.receive()):
                        link.send(datagram)
                    select.select([link.fileno()], [], [], 0.05)
        finally:
            link.close()
    assert struck == mended == faults


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("name", "foreign"),
    [("three_rovers_dead_drive", 3), ("three_rovers_frozen_gps", 3), ("mixed_dead_drive", 1)],
)
def test_the_rescue(name: str, foreign: int, tmp_path: Path) -> None:
    """EKF, arming, probe, experiments, the right verdict, the mission as expected; no orphan."""
    code, said, firmware = run(Path(__file__).with_name(f"{name}.yaml"), tmp_path / "run")
    assert code == 0, said
    assert len(firmware) == foreign
    assert not any(Path(f"/proc/{pid}").exists() for pid in firmware)


@pytest.mark.timeout(600)
def test_a_healthy_rover_is_probed_and_follows_its_mission(tmp_path: Path) -> None:
    tree = lone_rover().model_dump(mode="json", exclude_none=True) | ABLE
    tree["expect"] = {"alarm": False, "goals": {1: ["reached"]}}
    file = tmp_path / "lone.yaml"
    file.write_text(yaml.safe_dump(tree))
    code, said, _ = run(file, tmp_path / "run")
    assert code == 0, said
    assert "all vehicles answer as their twins do" in said


@pytest.mark.timeout(600)
def test_a_fault_that_the_firmware_makes_itself_is_noticed(tmp_path: Path) -> None:
    """SIM_GPS_GLITCH_X over its second line: the receiver jumps by 1 m. What is named is another
    matter (docs/real-vehicles.md)."""
    tree = lone_rover().model_dump(mode="json", exclude_none=True) | ABLE
    offset = {"vehicle": 1, "unit": "gps", "type": "offset", "size": [1.0, 0.0, 0.0]}
    tree["faults"] = [{**offset, "onset": {"when": "rover_1.north_m > 4"}}]
    file = tmp_path / "lone.yaml"
    file.write_text(yaml.safe_dump(tree))
    _, said, _ = run(file, tmp_path / "run")
    happened = said.index("rover_1: gps all offset 1, 0, 0")
    assert said.index("rover_1 does not answer as its twin does (north)") > happened
