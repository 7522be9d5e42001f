"""Replay: a stored log of a rescue still gives the decisions of then; and what differs is said.

The log is of `hil run scenarios/rescue.yaml --in-memory`; `tests/data/keep_rescue.py` renews it.
"""

import lzma
from dataclasses import replace
from pathlib import Path

import pytest

from base_station.records import Event
from base_station.replay import differences, replay
from base_station.tlog import read_tlog
from hil.bench.replaying import read_decisions, replay_run
from hil.cli import main
from hil.scenario import StationView, load_station_view

DATA = Path(__file__).parents[1] / "data"


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "rescue.tlog"
    path.write_bytes(lzma.decompress((DATA / "rescue.tlog.xz").read_bytes()))
    return path


@pytest.fixture(scope="module")
def view() -> StationView:
    return load_station_view(DATA / "rescue-view.json")


@pytest.fixture(scope="module")
def then() -> tuple[Event, ...]:
    decisions = read_decisions(DATA / "rescue-events.jsonl")
    assert decisions is not None
    return decisions


@pytest.fixture(scope="module")
def now(log: Path, view: StationView) -> tuple[Event, ...]:
    return replay(view, read_tlog(log))


def test_the_stored_log_gives_the_same_decisions(
    now: tuple[Event, ...], then: tuple[Event, ...]
) -> None:
    assert [d.text for d in differences(then, now)] == []
    assert [e.kind for e in now] == ["anomaly", "hypotheses", "verdict"]
    assert now[-1].data["hypothesis"] == "motor_y_off"
    assert now[-1].data["decided"] is True


def test_before_the_experiment_the_log_cannot_tell(log: Path, view: StationView) -> None:
    frames = list(read_tlog(log))
    early = [f for f in frames if f[0] - frames[0][0] < 22_000_000]
    *_, last = replay(view, early)
    assert last.kind == "hypotheses"


def test_the_order_of_the_frames_of_different_links_does_not_matter(
    log: Path, view: StationView, now: tuple[Event, ...]
) -> None:
    frames = list(read_tlog(log))
    sysids = {m.sysid for m in view.fleet}
    station_last = sorted(frames, key=lambda f: f[1][5] not in sysids)
    assert differences(now, replay(view, station_last)) == ()


def test_differences_are_named(then: tuple[Event, ...]) -> None:
    later = tuple(replace(e, time_s=e.time_s + 1.0) for e in then if e.kind == "anomaly")
    missing, other = differences(then, later)[0], differences(then, later)[1:]
    assert "then: anomaly at" in missing.text
    assert "now: anomaly at" in missing.text
    assert all(d.text.startswith("only then:") for d in other)
    shifted = replace(then[1], data={"posterior": {"motor_y_off": 1.0}})
    assert len(differences(then, (then[0], shifted, then[2]))) == 1


def test_logs_alone_with_a_view(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", "--view", str(DATA / "rescue-view.json"), str(log)]) == 0
    assert "rover_2: motor_y_off" in capsys.readouterr().out


def test_a_folder_is_compared_with_what_was_decided_in_it(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "fleet.tlog").write_bytes(log.read_bytes())
    (tmp_path / "view.json").write_bytes((DATA / "rescue-view.json").read_bytes())
    events = (DATA / "rescue-events.jsonl").read_text()
    (tmp_path / "events.jsonl").write_text(events)
    assert replay_run([tmp_path], None) == 0
    assert "no decisions would differ" in capsys.readouterr().out
    (tmp_path / "events.jsonl").write_text(events.replace('"time_s": 36.1', '"time_s": 39.1'))
    assert replay_run([tmp_path], None) == 1
    assert "then: verdict at 39.1 s" in capsys.readouterr().out


def test_what_is_missing_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(tmp_path)]) == 2
    assert main(["replay", str(tmp_path / "a.tlog")]) == 2
    told = capsys.readouterr().err
    assert "no .tlog there" in told
    assert "--view: needed" in told
