"""Folders, ports, lines and the log of a run: what is on disk, and what the station may see."""

import json
import socket
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from bench_builders import RESCUE, outcome, rescue
from rich.console import Console as Terminal

from hil.bench.console import Console
from hil.bench.folders import (
    Folders,
    blind_view,
    choose_folders,
    collect,
    create_folders,
    pin_ports,
    write_inputs,
)
from hil.bench.lines import Tick, as_station_line, parse_station_line
from hil.bench.ports import PortBases, choose_ports
from hil.bench.recording import RECORDING, RecordedTruth, merge_recordings
from hil.bench.runlog import EVENTS_FILE, TRUTH_FILE, RunLog
from hil.cli import main
from hil.errors import InputError, ProcessDiedError
from hil.scenario import Scenario, load_scenario, load_station_view
from hil.world.truth import ContactEpisode, TruthRecord, VehicleTruth, parse_line


@pytest.fixture
def folders(tmp_path: Path) -> Folders:
    chosen = choose_folders(rescue(), tmp_path / "out")
    create_folders(chosen)
    return chosen


def quiet() -> Console:
    return Console(Terminal(file=StringIO()))


def test_the_default_folder_is_named_after_the_scenario(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    first = choose_folders(rescue(), None)
    assert str(first.run).startswith("runs/rescue-")
    assert not first.run.exists()


def test_a_folder_with_something_in_it_is_refused(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("data")
    with pytest.raises(InputError, match="not an empty folder"):
        choose_folders(rescue(), tmp_path)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be created"):
        create_folders(choose_folders(rescue(), tmp_path / "file" / "out"))


def test_the_station_folder_tells_nothing(folders: Folders) -> None:
    write_inputs(rescue(), blind_view(rescue()), folders)
    assert "rescue" not in folders.station.name
    assert folders.run_id in folders.station.name
    assert [p.name for p in folders.station.iterdir()] == ["view.json"]
    assert "rescue" not in (folders.station / "view.json").read_text()


def test_inputs_read_back_as_they_were(folders: Folders) -> None:
    scenario = pin_ports(rescue("seed=3"), PortBases(14000, 15000, 16000))
    write_inputs(scenario, blind_view(scenario), folders)
    assert load_scenario(folders.run / "scenario.yaml") == scenario
    view = load_station_view(folders.station / "view.json")
    assert [m.mavlink_port for m in view.fleet] == [15000, 15010, 15020]


def test_views_differ_by_seed_and_not_by_fault() -> None:
    stuck: dict[str, Any] = {"vehicle": 2, "unit": "gps", "type": "stuck", "axes": ["east"]}
    tree = rescue().model_dump()
    swapped = Scenario.model_validate(tree | {"faults": [stuck], "name": "stuck_gps"})
    assert blind_view(rescue()) == blind_view(swapped)
    assert blind_view(rescue()).station_seed != blind_view(rescue("seed=1")).station_seed
    assert blind_view(rescue("seed=1")).station_seed != 1


def test_what_the_station_wrote_ends_up_in_the_run(folders: Folders) -> None:
    (folders.run / "events.jsonl").write_text("ours")
    for name in ("events.jsonl", "rover_1.tlog", "station.rrd"):
        (folders.station / name).write_text("theirs")
    collect(folders)
    assert not folders.station.exists()
    assert {p.name for p in folders.run.iterdir()} == {
        "events.jsonl",
        "station-events.jsonl",
        "rover_1.tlog",
        "station.rrd",
    }


def test_the_truth_becomes_part_of_the_mission(folders: Folders) -> None:
    assert merge_recordings(folders.run) is None
    recorded = RecordedTruth(folders, rescue(), viewer=None)
    recorded.truth(TruthRecord(1.0, {1: VehicleTruth(1.0, 2.0, 0.5, 0.0, 0.0)}))
    recorded.contact(ContactEpisode(1.0, 2.0, ("rover_1", "rover_2"), 3.0, (1.0, 2.0)))
    recorded.fault(1.0, "rover_2: motor 3 off")
    recorded.close()
    assert merge_recordings(folders.run) == folders.run / RECORDING
    assert [p.name for p in folders.run.iterdir()] == [RECORDING]


def test_free_ports_are_free_for_every_vehicle() -> None:
    scenario = rescue()
    bases = choose_ports(scenario)
    for base in (bases.physics, bases.mavlink, bases.injector):
        for i in range(len(scenario.fleet)):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
                sock.bind(("127.0.0.1", base + 10 * i))


def test_pinned_ports_are_kept() -> None:
    free = choose_ports(rescue())
    assert choose_ports(rescue(f"links.mavlink_port_base={free.mavlink}")).mavlink == free.mavlink


@pytest.mark.parametrize("kind", ["physics", "mavlink", "injector"])
def test_a_busy_pinned_port_is_named_and_nothing_is_made(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    base = getattr(choose_ports(rescue()), kind)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", base + 20))
        override = f"links.{kind}_port_base={base}"
        code = main(["run", str(RESCUE), "--set", override, "--out", str(tmp_path / "out")])
    assert code == 2
    line = capsys.readouterr().err
    assert f"links.{kind}_port_base: UDP port 127.0.0.1:{base + 20} is busy" in line
    assert line.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_host_that_is_not_ours_is_refused() -> None:
    with pytest.raises(InputError, match=r"links\.host"):
        choose_ports(rescue("links.host=192.0.2.1"))


def test_station_lines_are_typed() -> None:
    line = parse_station_line('{"type":"tick","time_s":1.5,"phase":"probe","more":1}')
    assert line == Tick(type="tick", time_s=1.5, phase="probe")
    assert parse_station_line("numba is compiling") is None


@pytest.mark.parametrize(
    "line", ['{"type":"tick"}', '{"type":"dance"}', "{", '{"type":"result","outcome":{}}']
)
def test_broken_station_lines_name_the_station(line: str) -> None:
    with pytest.raises(ProcessDiedError, match="base-station"):
        parse_station_line(line)


def test_the_log_keeps_what_was_said(tmp_path: Path) -> None:
    scenario = rescue()
    truth = TruthRecord(1.0, {1: VehicleTruth(1.0, 2.0, 0.0, 0.0, 0.0)})
    episode = ContactEpisode(1.0, 2.0, ("rover_1", "rover_2"), 3.0, (1.0, 2.0))
    event = {"type": "event", "time_s": 2.0, "kind": "anomaly", "text": "é", "data": {"a": 1}}
    with RunLog(scenario, tmp_path, quiet(), None) as log:
        log.truth(truth)
        log.contact(episode)
        log.struck(scenario.faults[0], 0.0)
        log.station(event)
        log.station({"type": "tick", "time_s": 2.1, "phase": "probe"})
        assert log.outcome is None
        log.station_line(as_station_line({"type": "result", "outcome": outcome().model_dump()}))
    record = log.record()
    assert (record.truth, record.contacts, log.tick_s) == (truth, (episode,), 2.1)
    assert record.outcome == outcome()
    assert record.struck[0].fault == scenario.faults[0]
    lines = (tmp_path / TRUTH_FILE).read_text().splitlines()
    assert [parse_line(line) for line in lines] == [truth, episode]
    events = [json.loads(line) for line in (tmp_path / EVENTS_FILE).read_text().splitlines()]
    assert [e["kind"] for e in events] == ["fault", "anomaly"]
    assert set(events[1]) == {"time_s", "kind", "text", "data"}
