"""MAVProxy, as a process of its own, against every airframe in the real world process."""

import re
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import pytest
from lone_vehicle import Console, Ports, lone_vehicle

MAVPROXY = shutil.which("mavproxy.py", path=str(Path(sys.executable).parent))
pytestmark = pytest.mark.skipif(MAVPROXY is None, reason="MAVProxy is not installed")
SPEED = 3.0
AGAIN = "again: "  # MAVProxy says it once; a velocity lasts for three seconds of vehicle time
MODULES = "log,wp,rally,fence,param,arm,mode,rc,misc,cmdlong,link,output,messagerate"
TROUBLE = (
    *("imeout", "down", "no link", "Failed", "rror", "retry", "DENIED", "UNSUPPORTED", "breach"),
    *("FAILED", "Failsafe", "arning"),
)
REFUSED = "Got COMMAND_ACK: INJECT_FAILURE: UNSUPPORTED"  # what has to be said on this port
HOME = "47.397742 8.545594"
NORTH_2_M = "47.39776"  # of home
WAY = """QGC WPL 110
0 1 0 16 0 0 0 0 47.397742 8.545594 488 1
1 0 3 16 0 0 0 0 47.397751 8.545594 3 1
2 0 3 16 0 0 0 0 47.397742 8.545594 3 1
"""
FLIGHT = """QGC WPL 110
0 1 0 16 0 0 0 0 47.397742 8.545594 488 1
1 0 3 22 0 0 0 0 0 0 3 1
2 0 3 16 0 0 0 0 47.397751 8.545594 4 1
3 0 3 21 0 0 0 0 47.397742 8.545594 0 1
"""
FENCE = """QGC WPL 110
0 0 3 5001 4 0 0 0 47.3975 8.5452 0 1
1 0 3 5001 4 0 0 0 47.3980 8.5452 0 1
2 0 3 5001 4 0 0 0 47.3980 8.5460 0 1
3 0 3 5001 4 0 0 0 47.3975 8.5460 0 1
4 0 3 5004 2 0 0 0 47.3979 8.5459 0 1
"""
RALLY = """QGC WPL 110
0 0 3 5100 0 0 0 0 47.397742 8.545594 3 1
"""
Script = tuple[tuple[str | None, str | None], ...]

LISTS: Script = (
    ("param set FS_TIMEOUT 7", None),  # a real one, and a whole one
    ("param set FENCE_ACTION 1", None),
    ("fence load fence.txt", "Got MISSION_ACK: TYPE_FENCE: ACCEPTED"),
    ("fence list", "Requesting 5 fence items"),
    (None, "Saved 5 fence items"),
    ("fence clear", "Got MISSION_ACK: TYPE_FENCE: ACCEPTED"),
    ("rally load rally.txt", "Got MISSION_ACK: TYPE_RALLY: ACCEPTED"),
    ("rally list", "Requesting 1 rally items"),
    (None, "Saved 1 rally items"),
    ("rally clear", "Got MISSION_ACK: TYPE_RALLY: ACCEPTED"),
    ("param fetch FS_TIMEOUT", r"FS_TIMEOUT = 7\.0"),
    ("param fetch FENCE_ACTION", r"FENCE_ACTION = 1"),
)
BEGIN: Script = (
    ("mode GUIDED", "Mode GUIDED"),
    ("arm throttle", "AP: Throttle armed"),
    (None, "ARMED"),
    ("watch LOCAL_POSITION_NED", None),
)


def goes_to_a_point(height_m: float) -> Script:
    return (
        (f"guided {NORTH_2_M} 8.545594 {height_m}", "DO_REPOSITION: ACCEPTED"),
        (None, r" x : (1\.[789]|2\.[0123])\d*, y : -?0\.[0123]"),
    )


def mission(last: int) -> Script:
    return (
        ("watch", None),
        ("wp load way.txt", "Got MISSION_ACK: TYPE_MISSION: ACCEPTED"),
        ("wp list", "Saved waypoints to"),
        ("wp set 1", "DO_SET_MISSION_CURRENT: ACCEPTED"),
        ("mode AUTO", "AP: Reached waypoint #1"),
        (None, f"AP: Reached waypoint #{last}"),
        (None, "AP: Mission Complete"),
    )


CLEARED: Script = (("wp clear", "Got MISSION_ACK: TYPE_MISSION: ACCEPTED"),)


def drive(throttle_percent: int, sideways: bool) -> Script:
    aside: Script = ((AGAIN + "velocity 0 -0.6 0", r"vy : -0\.5"),) if sideways else ()
    return (
        *LISTS,
        *BEGIN,
        (AGAIN + "velocity 0.6 0 0", r"vx : 0\.5"),
        *aside,
        *goes_to_a_point(0),
        *mission(2),
        *CLEARED,
        ("mode RTL", "Mode RTL"),
        ("mode MANUAL", "Mode MANUAL"),
        ("rc 3 1700", None),
        ("watch RC_CHANNELS", "chan3_raw : 1700"),
        ("watch VFR_HUD", f"throttle : {throttle_percent}"),
        ("watch", None),
        ("mode HOLD", "Mode HOLD"),
        ("disarm", "DISARMED"),
    )


FLY: Script = (
    *LISTS,
    *BEGIN,
    ("takeoff 3", "Got COMMAND_ACK: NAV_TAKEOFF: ACCEPTED"),
    (AGAIN + "velocity 1 0 0", r" z : -(2\.[789]|3\.[0-3])\d*, vx : (0\.9|1\.0)"),
    (AGAIN + "velocity 0 -1 0", r"vy : -(0\.9|1\.0)"),
    (AGAIN + "velocity 0 0 -1", r"vz : -(0\.9|1\.0)"),
    *goes_to_a_point(4),
    (None, r" z : -(3\.[789]|4\.[0123])"),
    ("mode LAND", "AP: Throttle disarmed"),
    ("watch", None),
    ("mode GUIDED", "Mode GUIDED"),
    ("arm throttle", "AP: Throttle armed"),
    *mission(3),
    (None, "AP: Throttle disarmed"),
    *CLEARED,
    ("mode STABILIZE", "Mode STABILIZE"),
    ("rc 3 1000", None),
    ("watch RC_CHANNELS", "chan3_raw : 1000"),
    ("arm throttle", "AP: Throttle armed"),
    ("rc 3 1600", None),
    ("watch LOCAL_POSITION_NED", r" z : -[3456]\."),
    ("rc 3 1500", None),
    ("rc 2 1400", None),  # forward
    (None, r"vx : 1\."),
    ("mode RTL", "Mode RTL"),
    ("rc all 0", None),
    (None, "AP: Throttle disarmed"),
    ("watch", None),
)


@contextmanager
def console(master: str, sysid: int, folder: Path, modules: str = MODULES) -> Iterator[Console]:
    """With its state in a folder of its own."""
    assert MAVPROXY is not None
    folder.mkdir(exist_ok=True)
    options = [f"--master={master}", f"--default-modules={modules}"]
    options += [f"--source-system={sysid}", f"--state-basedir={folder}"]
    prompt = Console([sys.executable, MAVPROXY, *options], folder)
    try:
        prompt.expect("Detected vehicle 2:1")
        prompt.expect("parameters to ")
        yield prompt
    finally:
        prompt.stop()


def follow(prompt: Console, script: Script) -> None:
    for said, heard in script:
        if said is not None and said.startswith(AGAIN):
            prompt.expect(str(heard), again=said.removeprefix(AGAIN))
            continue
        if said is not None:
            prompt.tell(said)
        if heard is not None:
            prompt.expect(heard)


def check_rates(prompt: Console) -> None:
    """A message comes as often as it was ordered, by the time of the vehicle."""
    prompt.tell("messagerate set SCALED_IMU 10")
    prompt.expect("SET_MESSAGE_INTERVAL: ACCEPTED")
    prompt.tell("watch SCALED_IMU")
    prompt.expect("< SCALED_IMU")  # comes at once
    lines = [prompt.expect("< SCALED_IMU") for _ in range(8)]
    times_ms = [int(re.findall(r"time_boot_ms : (\d+)", line)[0]) for line in lines]
    assert {after - before for before, after in pairwise(times_ms)} == {100}
    prompt.tell("messagerate set SCALED_IMU -1")
    prompt.expect("SET_MESSAGE_INTERVAL: ACCEPTED")
    prompt.tell("watch")


def check_failures(prompt: Console, ports: Ports, folder: Path) -> list[str]:
    """Refused on the station's port; by the injector's it shows there. What the injector read."""
    follow(prompt, (("long INJECT_FAILURE 4 1 0", REFUSED), ("watch GPS_RAW_INT", None)))
    address = f"udpout:127.0.0.1:{ports.injector}"
    with console(address, 246, folder / "injector", "log,param,cmdlong,link") as injector:
        injector.tell("param set SYS_FAILURE_EN 1")
        injector.expect("SYS_FAILURE_EN = 1", again="param fetch SYS_FAILURE_EN")
        for kind, fix in ((1, 1), (0, 6)):  # off, and sound again
            injector.tell(f"long INJECT_FAILURE 4 {kind} 0")
            injector.expect("Got COMMAND_ACK: INJECT_FAILURE: ACCEPTED")
            prompt.expect(f"fix_type : {fix}")
    return injector.said


@pytest.mark.parametrize(
    ("airframe", "script"),  # per cent: the mean of all motors with the stick at 40 %
    [
        ("omni_plus", drive(20, sideways=True)),
        ("omni_x", drive(28, sideways=True)),
        ("skid_steer", drive(40, sideways=False)),
        ("quad_x", FLY),
    ],
)
def test_mavproxy_and(airframe: str, script: Script, tmp_path: Path) -> None:
    for name, text in (("way", WAY), ("fence", FENCE), ("rally", RALLY)):
        text = FLIGHT if (airframe, name) == ("quad_x", "way") else text
        tabs = text.replace(" ", "\t").replace("QGC\tWPL\t", "QGC WPL ")
        (tmp_path / f"{name}.txt").write_text(tabs)
    with (
        lone_vehicle(tmp_path, airframe, SPEED) as ports,
        console(f"udpin:127.0.0.1:{ports.mavlink}", 245, tmp_path) as prompt,
    ):
        check_rates(prompt)
        follow(prompt, script)
        injected = check_failures(prompt, ports, tmp_path)
    said = [*prompt.said, *injected]
    troubles = [line for line in said if any(word in line for word in TROUBLE)]
    assert [line for line in troubles if REFUSED not in line] == []
