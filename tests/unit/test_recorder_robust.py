"""The recorder never raises into the station, never waits for a viewer, and loses little."""

import json
import logging
import math
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import recorder_fake_run as fake
import rerun as rr
from recorder_reading import rows, temporal

from base_station.recorder import Recorder
from base_station.recording import streams
from base_station.recording.merge import merge
from base_station.recording.outlets import QUEUE_LENGTH, UNLIMITED, Queued
from base_station.records import Snapshot

NOWHERE = (math.nan, math.nan)
HERE = Path(__file__).parent


@pytest.fixture(autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


def first() -> Snapshot:
    return next(fake.snapshots())


def test_what_is_not_known_yet_is_left_out(tmp_path: Path) -> None:
    told = first()
    blind = replace(
        told.vehicles[1],
        reported_m=NOWHERE,
        velocity_mps=NOWHERE,
        yaw_rad=math.nan,
        residual=NOWHERE,
        cusum=NOWHERE,
        motor_outputs=(),
        battery_percent=math.nan,
    )
    twin = replace(told.twins[0], true_m=told.twins[0].true_m * math.nan)
    vehicles = (told.vehicles[0], blind, told.vehicles[2])
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    recorder.snapshot(replace(told, vehicles=vehicles, twins=(twin,)))
    recorder.snapshot(replace(told, time_s=0.1))
    recorder.close()
    assert recorder.failures == 0
    assert [t for t, _ in temporal(tmp_path / "a.rrd", "/fleet", "Cylinders3D:centers")] == [0.1]
    [(_, residual), _] = temporal(tmp_path / "a.rrd", "/residual/north", "Scalars:scalars")
    assert math.isnan(residual[1])
    assert residual[0] == pytest.approx(told.vehicles[0].residual[0], abs=1.0 / 1024.0)


def test_a_hypothesis_nobody_has_heard_of_is_shown_too(tmp_path: Path) -> None:
    told = first()
    twin = replace(told.twins[0], hypothesis="gyro_upside_down")
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    recorder.snapshot(replace(told, twins=(twin,)))
    recorder.close()
    assert recorder.failures == 0
    assert temporal(tmp_path / "a.rrd", "/twins/gyro_upside_down/body", "Cylinders3D:centers")
    line = "/belief/posterior/gyro_upside_down"
    assert temporal(tmp_path / "a.rrd", line, "Scalars:scalars") == [(told.time_s, [1.0])]
    assert rows(tmp_path / "a.rrd", line, "SeriesLines:names")[0][1] == ["gyro_upside_down"]


def test_a_file_that_cannot_be_written_is_one_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        recorder = Recorder(tmp_path / "missing" / "a.rrd", "demo", fake.view())
        recorder.snapshot(first())
        recorder.event(fake.events()[0])
        recorder.close()
    assert recorder.failures == 1
    assert "the run goes on" in caplog.text


def test_a_slow_file_holds_up_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gate, to_file = threading.Event(), streams.to_file

    def slow(*given: Any) -> Any:
        assert gate.wait(10.0)
        return to_file(*given)

    monkeypatch.setattr(streams, "to_file", slow)
    told = list(fake.snapshots())
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    for snapshot in told:
        recorder.snapshot(snapshot)
    gate.set()
    recorder.close()
    assert recorder.failures == 0
    assert len(temporal(tmp_path / "a.rrd", "/fleet", "Cylinders3D:centers")) == len(told)


def test_closing_twice_and_telling_after_it_are_harmless(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    recorder.close()
    recorder.snapshot(first())
    recorder.close()
    assert recorder.failures == 0


def test_no_viewer_there_is_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound, but nobody listens
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        with caplog.at_level(logging.WARNING):
            recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view(), viewer=address)
            recorder.snapshot(first())
            recorder.close()
    assert recorder.failures == 0
    assert f"no Rerun viewer at {address}" in caplog.text
    assert temporal(tmp_path / "a.rrd", "/fleet", "Cylinders3D:centers")


@pytest.mark.parametrize("limit", [QUEUE_LENGTH, UNLIMITED])
def test_a_queue_never_waits_and_drops_only_beyond_its_limit(limit: int) -> None:
    outlet = Queued(limit)
    with socket.socket() as gate_in, socket.socket() as gate_out:
        gate_in.bind(("127.0.0.1", 0))
        gate_in.listen()
        outlet.put(lambda: gate_in.accept()[0].close())  # stuck until somebody connects
        heard: list[int] = []
        for k in range(1000):
            outlet.put(lambda k=k: heard.append(k))  # type: ignore[misc]
        assert (outlet.dropped >= 499) == (limit == QUEUE_LENGTH)
        assert outlet.dropped == 0 or limit
        gate_out.connect(gate_in.getsockname())
        assert outlet.close()
    assert heard == list(range(1000 - outlet.dropped))


STALLED = """
import socket, sys
sys.path.insert(0, {here!r})
import recorder_fake_run as fake
from pathlib import Path
from base_station.recorder import Recorder
with socket.socket() as viewer:
    viewer.bind(("127.0.0.1", 0))
    viewer.listen()  # accepts, and never answers
    address = f"127.0.0.1:{{viewer.getsockname()[1]}}"
    recorder = Recorder(Path(sys.argv[1]), "demo", fake.view(), viewer=address)
    for snapshot in list(fake.snapshots())[:50]:
        recorder.snapshot(snapshot)
    recorder.close()
    print("closed", recorder.failures)
"""


def test_a_viewer_that_never_reads_holds_up_nobody(tmp_path: Path) -> None:
    script = STALLED.format(here=str(HERE))
    command = [sys.executable, "-c", script, str(tmp_path / "a.rrd")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "closed 0\n"
    assert len(temporal(tmp_path / "a.rrd", "/fleet", "Cylinders3D:centers")) == 50


CHILD = """
import dataclasses, json, sys, threading, time
sys.path.insert(0, {here!r})
import recorder_fake_run as fake
from pathlib import Path
from base_station.recorder import Recorder
from base_station.recording import columns
columns.MAX_TICKS = 10**9  # let only the clock send
recorder = Recorder(Path(sys.argv[1]), "demo", fake.view())
told = next(fake.snapshots())
for k, line in enumerate(sys.stdin):
    recorder.snapshot(dataclasses.replace(told, time_s=0.1 * k))
    taken = threading.Event()  # a flood of ticks would wait in the queue
    recorder._tell(lambda _: taken.set())
    taken.wait()
    print(json.dumps(time.time()), flush=True)
"""


def test_a_kill_loses_at_most_a_second(tmp_path: Path) -> None:
    path = tmp_path / "a.rrd"
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD.format(here=str(HERE)), str(path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdin
    assert child.stdout
    first_s = last_s = 0.0
    while last_s - first_s < 4.0:  # some sends; each line waits for its answer
        child.stdin.write("tick\n")
        child.stdin.flush()
        last_s = json.loads(child.stdout.readline())
        first_s = first_s or last_s
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    child.stdin.close()
    child.stdout.close()
    merge([path], tmp_path / "b.rrd")
    found = temporal(tmp_path / "b.rrd", "/fleet", "Cylinders3D:centers", timeline="wall_time")
    assert last_s - found[-1][0] < 1.0
