"""Telemetry logs: what is written comes back, here and in the tools of others."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from base_station.tlog import TlogWriter, read_tlog, split
from hil.errors import InputError

START_US = 1_700_000_000_000_000


def heartbeat(sysid: int, sequence: int = 0) -> bytes:
    link = mavlink.MAVLink(None, srcSystem=sysid, srcComponent=1)
    link.seq = sequence
    message = link.heartbeat_encode(
        mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4
    )
    return bytes(message.pack(link))


def signed_heartbeat() -> bytes:
    link = mavlink.MAVLink(None, srcSystem=7, srcComponent=1)
    link.signing.secret_key = b"k" * 32
    link.signing.sign_outgoing = True
    message = link.heartbeat_encode(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4)
    return bytes(message.pack(link))


def written(path: Path, frames: list[bytes]) -> list[tuple[int, bytes]]:
    rows = [(START_US + 100_000 * i, frame) for i, frame in enumerate(frames)]
    with TlogWriter(path) as log:
        for time_us, frame in rows:
            log.write(time_us, frame)
    return rows


def test_frames_and_times_come_back(tmp_path: Path) -> None:
    rows = written(tmp_path / "a.tlog", [heartbeat(1), heartbeat(250), signed_heartbeat()])
    assert list(read_tlog(tmp_path / "a.tlog")) == rows


def test_mavlogdump_reads_it(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    with TlogWriter(path) as log:
        log.write(START_US, heartbeat(1) + heartbeat(2, 1))
        log.write(START_US + 500_000, heartbeat(250))
    tool = Path(sys.executable).parent / "mavlogdump.py"
    dump = subprocess.run(
        [sys.executable, "-W", "ignore", tool, "--show-source", path],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "TZ": "UTC"},
    ).stdout.splitlines()
    assert [line.split(" ", 2)[2].split(" ")[0] for line in dump] == ["HEARTBEAT"] * 3
    assert ["srcSystem=1 " in dump[0], "srcSystem=2 " in dump[1]] == [True, True]
    assert dump[0].startswith("2023-11-14 22:13:20.00")
    assert dump[2].startswith("2023-11-14 22:13:20.50")


def test_a_datagram_of_two_frames_gets_two_stamps(tmp_path: Path) -> None:
    written(tmp_path / "a.tlog", [heartbeat(1) + heartbeat(2)])
    assert list(read_tlog(tmp_path / "a.tlog")) == [
        (START_US, heartbeat(1)),
        (START_US, heartbeat(2)),
    ]


def test_what_is_no_frame_is_left_out() -> None:
    assert list(split(b"\x00noise" + heartbeat(1) + b"\xfd\x09")) == [heartbeat(1)]


@pytest.mark.parametrize("lost", [1, 5, 20, 21, 28])
def test_a_truncated_tail_costs_only_the_last_frame(tmp_path: Path, lost: int) -> None:
    path = tmp_path / "a.tlog"
    rows = written(path, [heartbeat(1), heartbeat(2)])
    path.write_bytes(path.read_bytes()[:-lost])
    assert list(read_tlog(path)) == rows[:1]


def test_a_second_of_writes_is_on_disk_before_close(tmp_path: Path) -> None:
    with TlogWriter(tmp_path / "a.tlog") as log:
        for i in range(25):
            log.write(START_US + 100_000 * i, heartbeat(1, i))
        assert len(list(read_tlog(tmp_path / "a.tlog"))) >= 21


def test_something_else_is_refused_with_its_place(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(b"scenario: rescue, not a log")
    with pytest.raises(InputError, match=r"byte 8 is 0x3a.*is it a \.tlog\?"):
        list(read_tlog(path))
    with pytest.raises(InputError, match="cannot be read"):
        list(read_tlog(tmp_path / "missing.tlog"))
