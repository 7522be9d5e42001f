"""Logs in parts: nothing is lost between them, and with a limit the oldest go."""

from pathlib import Path

import pytest
import recorder_fake_run as fake
from recorder_reading import temporal

from base_station.listeners import TelemetryLogs
from base_station.parts import Room, next_part, parts_of
from base_station.recorder import Recorder
from base_station.recording.merge import merge
from base_station.tlog import read_tlog
from hil.mavlink import Encoder
from hil.options import megabytes

FRAME = Encoder(1, 1).gcs_heartbeat()
ROW = 8 + len(FRAME)  # bytes in a telemetry log


def logged(folder: Path, room: Room, times_us: range, append: bool = False) -> None:
    logs = TelemetryLogs(folder, fake.view(), append, room)
    for time_us in times_us:
        logs.datagram(0, time_us, FRAME)
    logs.close()


def times(folder: Path) -> list[int]:
    parts = parts_of(folder / "rover_1.tlog")
    return [time_us for part in parts for time_us, _ in read_tlog(part)]


def test_nothing_is_lost_between_parts(tmp_path: Path) -> None:
    logged(tmp_path, Room(10 * ROW), range(105))
    parts = parts_of(tmp_path / "rover_1.tlog")
    assert [p.name for p in parts[:2]] == ["rover_1.tlog", "rover_1-2.tlog"]
    assert [p.name for p in parts] == [p.name for p in sorted(parts, key=lambda p: len(p.name))]
    assert [p.stat().st_size for p in parts] == [10 * ROW] * 10 + [5 * ROW]
    assert times(tmp_path) == list(range(105))


def test_a_resumed_log_goes_on_in_its_last_part(tmp_path: Path) -> None:
    logged(tmp_path, Room(10 * ROW), range(25))
    logged(tmp_path, Room(10 * ROW), range(25, 40), append=True)
    assert times(tmp_path) == list(range(40))
    assert len(parts_of(tmp_path / "rover_1.tlog")) == 5


def test_a_log_that_begins_anew_leaves_nothing_of_one_before(tmp_path: Path) -> None:
    logged(tmp_path, Room(10 * ROW), range(25))
    logged(tmp_path, Room(10 * ROW), range(3))
    assert times(tmp_path) == [0, 1, 2]


def test_with_a_limit_the_oldest_parts_go(tmp_path: Path) -> None:
    room = Room(10 * ROW, 60 * ROW)
    logged(tmp_path, room, range(1005))
    kept = times(tmp_path)
    assert kept == list(range(kept[0], 1005))
    assert 50 <= len(kept) <= 60
    assert {"rover_2.tlog", "rover_3.tlog"} <= {p.name for p in tmp_path.iterdir()}


def test_what_is_not_a_part_is_left_alone(tmp_path: Path) -> None:
    others = ["journal-0001.bin", "events.jsonl", "mission.rrd"]
    for name in others:
        (tmp_path / name).write_bytes(bytes(100 * ROW))
    logged(tmp_path, Room(10 * ROW, 30 * ROW), range(100))
    assert {p.name for p in tmp_path.iterdir()} > set(others)


def test_a_recording_in_parts_is_one_recording(tmp_path: Path) -> None:
    story = list(fake.snapshots())
    path = tmp_path / "station.rrd"
    recorder = Recorder(path, "demo", fake.view(), room=Room(part_bytes=1))
    fake.tell(recorder, story)
    recorder.close()
    assert recorder.failures == 0
    parts = parts_of(path)
    assert len(parts) == 1 + len(story) // 100
    merge(parts, tmp_path / "mission.rrd")
    rows = temporal(tmp_path / "mission.rrd", "/residual/north", "Scalars:scalars")
    assert [time_s for time_s, _ in rows] == pytest.approx([s.time_s for s in story])
    *_, (_, [page]) = temporal(parts[-1], "/brief", "TextDocument:text")
    assert "| motor_y_off | 0.9940 |" in page  # told in a part before


def test_the_next_part_comes_after_those_there_are(tmp_path: Path) -> None:
    first = tmp_path / "station.rrd"
    assert next_part(first) == first
    for name in ("station.rrd", "station-9.rrd", "station-10.rrd"):
        (tmp_path / name).touch()
    assert next_part(first).name == "station-11.rrd"


def test_a_limit_has_room_for_every_log() -> None:
    assert Room.of_megabytes(None) == Room()
    room = Room.of_megabytes(megabytes("160"))
    assert (room.part_bytes, room.total_bytes) == (10_000_000, 160_000_000)
