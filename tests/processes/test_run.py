"""`hil run` as processes: what it leaves behind when all goes well, and when somebody dies.

With the stub station for what does not depend on what the station thinks, with the real one for
what does.
"""

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from children import HIL, ROOT, Child, child

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")

RESCUE = ROOT / "scenarios" / "rescue.yaml"
STUB_RUN = (sys.executable, str(Path(__file__).with_name("stub_run.py")))
GONE_WITHIN_S = 30.0
PROBING = "tiny displacements"

VICTIMS: dict[str, tuple[str, str]] = {
    "world": (" hil.cli world ", "world was killed by SIGKILL"),
    "vehicle": (" --sysid 2", "sim-vehicle rover_2 was killed by SIGKILL"),
    "station": ("view.json --out . ", "base-station was killed by SIGKILL"),
}


def stub_run(out: Path, way: str) -> tuple[str, ...]:
    return (*STUB_RUN, way, str(RESCUE), str(out))


def real_run(out: Path) -> tuple[str, ...]:
    return (*HIL, "run", str(RESCUE), "--out", str(out), "--speed", "0")


def descendants(pid: int) -> dict[int, str]:
    """Command lines of all processes below one, by process id."""
    found: dict[int, str] = {}
    for thread in Path(f"/proc/{pid}/task").iterdir():
        for below in map(int, (thread / "children").read_text().split()):
            raw = Path(f"/proc/{below}/cmdline").read_bytes()
            found[below] = raw.replace(b"\0", b" ").decode()
            found |= descendants(below)
    return found


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def assert_gone(pids: dict[int, str]) -> None:
    """The kernel may take a moment to bury them."""
    deadline_s = time.monotonic() + GONE_WITHIN_S
    while alive := [words for pid, words in pids.items() if is_alive(pid)]:
        assert time.monotonic() < deadline_s, f"orphans: {alive}"
        os.sched_yield()


def wait_line(run: Child, words: str) -> None:
    while words not in run.wait_for(""):
        pass


def assert_readable(out: Path, ended: str) -> None:
    for name in ("events.jsonl", "truth.jsonl"):
        assert [json.loads(line) for line in (out / name).read_text().splitlines()]
    assert ended in json.loads((out / "result.json").read_text())["ended"]
    assert not list(out.parent.glob(".station-*"))


def test_a_run_leaves_the_whole_contract(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with child(*stub_run(out, "conclude")) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        assert run.wait() == 1  # the stub gets nobody home
    assert_gone(started)
    assert_readable(out, "completed")
    assert {"world.log", "rover_1.log", "base-station.log", "scenario.yaml", "mission.rrd"} <= {
        p.name for p in out.iterdir()
    }
    result = json.loads((out / "result.json").read_text())
    assert result["correct"] is True
    assert result["truth"]["faults"][0]["time_s"] == 0.0
    assert result["goals"]["1"]["final_distance_m"] == pytest.approx(4.03, abs=0.01)
    truth = [json.loads(line) for line in (out / "truth.jsonl").read_text().splitlines()]
    assert truth[0]["time_s"] == 0.0
    assert truth[-1]["time_s"] >= 2.0


def test_nothing_handed_to_the_station_names_the_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("PWD", "OLDPWD", "_"):
        monkeypatch.setenv(name, "/home/somebody/rescue")
    out = tmp_path / "out"
    with child(*stub_run(out, "conclude")) as run:
        wait_line(run, PROBING)
        (station,) = [
            pid
            for pid, words in descendants(run.process.pid).items()
            if VICTIMS["station"][0] in words
        ]
        folder = os.readlink(f"/proc/{station}/cwd")
        log = os.readlink(f"/proc/{station}/fd/2")
        environment = Path(f"/proc/{station}/environ").read_text()
        run.wait()
    arguments = (out / "station_was_here.txt").read_text()
    for told in (folder, log, arguments, environment, (out / "view.json").read_text()):
        assert "rescue" not in told


@pytest.mark.parametrize(("pattern", "words"), VICTIMS.values(), ids=VICTIMS.keys())
def test_whoever_is_killed_is_named(pattern: str, words: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with child(*stub_run(out, "wait")) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        kill_one(started, pattern)
        assert run.wait() == 3
    assert_gone(started)
    assert_readable(out, words)
    assert run.stderr().startswith(f"hil: {words}")
    assert run.stderr().count("\n") == 1


def kill_one(pids: dict[int, str], pattern: str) -> None:
    (victim,) = [pid for pid, words in pids.items() if pattern in words]
    os.kill(victim, signal.SIGKILL)


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("leave", "base-station ended with exit code 1: the stub has had enough"),
        ("garbage", "base-station said a line that breaks its contract: tick.time_s"),
        ("hang", "base-station hangs"),
    ],
)
def test_a_station_that_misbehaves_is_named(way: str, words: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with child(*stub_run(out, way)) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        assert run.wait() == 3
    assert_gone(started)
    assert_readable(out, words)


def test_a_vehicle_that_freezes_is_named(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with child(*stub_run(out, "wait")) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        (victim,) = [pid for pid, words in started.items() if VICTIMS["vehicle"][0] in words]
        os.kill(victim, signal.SIGSTOP)
        assert run.wait() == 3
    assert_gone(started)
    assert_readable(out, "rover_2 (sysid 2")


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["SIGINT", "SIGTERM"]
)
def test_an_interrupted_run_is_tidy(number: signal.Signals, code: int, tmp_path: Path) -> None:
    out = tmp_path / "out"
    with child(*stub_run(out, "wait")) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        run.signal(number)
        assert run.wait() == code
    assert_gone(started)
    assert_readable(out, f"interrupted by {number.name}")
    assert "Traceback" not in run.stderr()


def test_a_killed_bench_leaves_no_orphans(tmp_path: Path) -> None:
    with child(*stub_run(tmp_path / "out", "wait")) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        run.signal(signal.SIGKILL)
        run.wait()
    assert len(started) == 5
    assert_gone(started)


@pytest.mark.parametrize(("pattern", "words"), VICTIMS.values(), ids=VICTIMS.keys())
def test_whoever_of_the_real_ones_is_killed_is_named(
    pattern: str, words: str, tmp_path: Path
) -> None:
    pytest.importorskip("base_station.planning.process")
    out = tmp_path / "out"
    with child(*real_run(out)) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        kill_one(started, pattern)
        assert run.wait() == 3
    assert_gone(started)
    assert words in run.stderr()
    assert_readable(out, words)
    assert_recording_reads(out / "mission.rrd")


def test_a_planner_that_is_killed_is_started_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with child(*real_run(out), "--set", "planning.planner=cem") as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        kill_one(started, "base_station.planning.process")
        wait_line(run, "drive plan alpha")  # which the one started again has found
        started |= descendants(run.process.pid)
        run.signal(signal.SIGINT)
        assert run.wait() == 130
    assert_gone(started)
    assert "planner was killed by SIGKILL" in (out / "base-station.log").read_text()


def test_a_killed_bench_leaves_no_real_orphans(tmp_path: Path) -> None:
    pytest.importorskip("base_station.planning.process")
    with child(*real_run(tmp_path / "out")) as run:
        wait_line(run, PROBING)
        started = descendants(run.process.pid)
        run.signal(signal.SIGKILL)
        run.wait()
    assert len(started) == 6
    assert_gone(started)


def assert_recording_reads(path: Path) -> None:
    chunk = pytest.importorskip("rerun.chunk")
    read: Callable[[str], object] = chunk.RrdReader
    paths = read(str(path)).stream().collect().schema().entity_paths()  # type: ignore[attr-defined]
    assert any(str(p).startswith("/truth") for p in paths)
