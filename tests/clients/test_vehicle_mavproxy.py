"""MAVProxy, as a process of its own, against a vehicle in the real world process."""

import shutil
import sys
from pathlib import Path

import pytest
from lone_vehicle import Console, Ports, lone_vehicle

MAVPROXY = shutil.which("mavproxy.py", path=str(Path(sys.executable).parent))
pytestmark = pytest.mark.skipif(MAVPROXY is None, reason="MAVProxy is not installed")
SPEED = 3.0
AGAIN = "again: "  # MAVProxy says it once; a velocity lasts for three seconds of vehicle time
MODULES = "log,wp,rally,fence,param,arm,mode,rc,misc,cmdlong,link,output"
TROUBLE = (
    "imeout",
    "down",
    "no link",
    "Failed",
    "rror",
    "retry",
    "DENIED",
    "UNSUPPORTED",
    "breach",
)
WAY = """QGC WPL 110
0 1 0 16 0 0 0 0 47.397742 8.545594 488 1
1 0 3 16 0 0 0 0 47.397751 8.545594 3 1
2 0 3 16 0 0 0 0 47.397742 8.545594 3 1
"""
Script = tuple[tuple[str | None, str | None], ...]


def drive(throttle_percent: int) -> Script:
    return (
        ("param set FS_TIMEOUT 7", None),
        ("mode GUIDED", "Mode GUIDED"),
        ("arm throttle", "AP: Throttle armed"),
        (None, "ARMED"),
        ("watch VFR_HUD", None),
        (AGAIN + "velocity 0.6 0 0", "groundspeed : 0.5"),
        ("watch", None),
        ("wp load way.txt", "Got MISSION_ACK: TYPE_MISSION: ACCEPTED"),
        ("wp list", "Saved waypoints to"),
        ("wp set 1", "DO_SET_MISSION_CURRENT: ACCEPTED"),
        ("mode AUTO", "AP: Reached waypoint #1"),
        (None, "AP: Mission Complete"),
        ("wp clear", "Got MISSION_ACK: TYPE_MISSION: ACCEPTED"),
        ("mode RTL", "Mode RTL"),
        ("mode MANUAL", "Mode MANUAL"),
        ("rc 3 1700", None),
        ("watch RC_CHANNELS", "chan3_raw : 1700"),
        ("watch VFR_HUD", f"throttle : {throttle_percent}"),
        ("watch", None),
        ("mode HOLD", "Mode HOLD"),
        ("disarm", "DISARMED"),
        ("param fetch FS_TIMEOUT", "FS_TIMEOUT = 7.0"),
        ("fence list", "Requesting 0 fence items"),
        ("rally list", "Requesting 0 rally items"),
    )


def console(ports: Ports, folder: Path) -> Console:
    """On the station's port, with its state in a folder of its own."""
    assert MAVPROXY is not None
    (folder / "way.txt").write_text(WAY.replace(" ", "\t").replace("QGC\tWPL\t", "QGC WPL "))
    options = [f"--master=udpin:127.0.0.1:{ports.mavlink}", f"--default-modules={MODULES}"]
    options += ["--source-system=245", f"--state-basedir={folder}"]
    return Console([sys.executable, MAVPROXY, *options], folder)


def follow(prompt: Console, script: Script) -> None:
    prompt.expect("Detected vehicle 2:1")
    prompt.expect("parameters to ")
    for said, heard in script:
        if said is not None and said.startswith(AGAIN):
            prompt.expect(str(heard), again=said.removeprefix(AGAIN))
            continue
        if said is not None:
            prompt.tell(said)
        if heard is not None:
            prompt.expect(heard)


@pytest.mark.parametrize(
    ("airframe", "throttle_percent"),  # mean of all motors with the stick at 40 %
    [("omni_plus", 20), ("omni_x", 28), ("skid_steer", 40)],
)
def test_mavproxy_and(airframe: str, throttle_percent: int, tmp_path: Path) -> None:
    with lone_vehicle(tmp_path, airframe, SPEED) as ports:
        prompt = console(ports, tmp_path)
        try:
            follow(prompt, drive(throttle_percent))
        finally:
            prompt.stop()
    assert [line for line in prompt.said if any(word in line for word in TROUBLE)] == []
