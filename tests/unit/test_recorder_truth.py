"""The truth under its own root, and parts merged into one recording."""

import logging
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import recorder_fake_run as fake
import rerun as rr
from recorder_reading import entities, rows, temporal
from rerun.chunk import RrdReader

import base_station.recording.merge as merging
from base_station.recorder import Recorder
from base_station.recording.merge import merge
from base_station.recording.truth import TruthRecorder
from base_station.records import Snapshot


@pytest.fixture(scope="module", autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("parts")
    story: list[Snapshot] = list(fake.snapshots())[:300]
    station = Recorder(folder / "station.rrd", "demo", fake.view())
    truth = TruthRecorder(folder / "truth.rrd", "demo", fake.scenario())
    fake.tell(station, story)
    fake.tell_truth(truth, story)
    station.close()
    truth.close()
    assert station.failures == truth.failures == 0
    return folder / "station.rrd", folder / "truth.rrd"


def test_the_truth_is_under_its_root_alone(parts: tuple[Path, Path]) -> None:
    assert entities(parts[1]) == {
        f"/truth/{name}" for name in ("fleet", "trail", "contacts", "contact_log", "faults")
    }


def test_true_places_are_east_north_up(parts: tuple[Path, Path]) -> None:
    found = temporal(parts[1], "/truth/fleet", "Cylinders3D:centers")
    assert len(found) == 300
    time_s, centers = found[185]
    assert np.array(centers)[:, :2] == pytest.approx(fake.truth_at(time_s)[:, ::-1], abs=1e-6)


def test_contacts_have_a_place_and_an_area_by_impulse(parts: tuple[Path, Path]) -> None:
    told = sorted(fake.contacts())
    places = temporal(parts[1], "/truth/contacts", "Points3D:positions")
    assert [t for t, _ in places] == pytest.approx([c[0] for c in told])
    north, east = told[0][2]
    assert places[0][1][0][:2] == pytest.approx([east, north], abs=1e-6)
    radii = [radius for _, [radius] in temporal(parts[1], "/truth/contacts", "Points3D:radii")]
    assert (radii[0] / radii[1]) ** 2 == pytest.approx(told[0][3] / told[1][3], rel=1e-5)
    assert temporal(parts[1], "/truth/contacts", "Points3D:labels")[0][1] == ["4.0 N s"]


def test_faults_are_lines_of_text(parts: tuple[Path, Path]) -> None:
    assert temporal(parts[1], "/truth/faults", "TextLog:text") == [
        (0.0, ["fault (truth): rover_2: motors 3 and 4 off"])
    ]


def test_parts_become_one_recording_with_the_blueprint(
    parts: tuple[Path, Path], tmp_path: Path
) -> None:
    out = tmp_path / "mission.rrd"
    merge(parts, out)
    assert [r.recording_id for r in RrdReader(str(out)).recordings()] == ["demo"]
    assert len(RrdReader(str(out)).blueprints()) == 1
    assert entities(out) >= entities(parts[0]) | entities(parts[1])
    for part, entity in zip(parts, ("/fleet", "/truth/fleet"), strict=True):
        component = "Cylinders3D:centers"
        assert temporal(out, entity, component) == temporal(part, entity, component)


def test_a_truncated_part_loses_its_end_only(parts: tuple[Path, Path], tmp_path: Path) -> None:
    cut = tmp_path / "station.rrd"
    whole = parts[0].read_bytes()
    cut.write_bytes(whole[: int(len(whole) * 0.5)])
    merge([cut, parts[1]], tmp_path / "mission.rrd")
    found = temporal(tmp_path / "mission.rrd", "/fleet", "Cylinders3D:centers")
    assert 0 < len(found) < 300
    assert len(temporal(tmp_path / "mission.rrd", "/truth/fleet", "Cylinders3D:centers")) == 300


def test_a_part_that_is_missing_or_empty_does_not_matter(
    parts: tuple[Path, Path], tmp_path: Path
) -> None:
    (tmp_path / "empty.rrd").touch()
    merge([tmp_path / "missing.rrd", tmp_path / "empty.rrd", parts[1]], tmp_path / "mission.rrd")
    assert rows(tmp_path / "mission.rrd", "/truth/fleet", "Cylinders3D:radii")


def test_without_the_tool_the_largest_part_is_kept(
    parts: tuple[Path, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setattr(merging, "rerun", lambda *_: ["/nowhere/rerun"])
    with caplog.at_level(logging.WARNING):
        merge(parts, tmp_path / "mission.rrd")
    assert (tmp_path / "mission.rrd").read_bytes() == parts[0].read_bytes()
    assert "is a copy of station.rrd alone" in caplog.text


def test_no_part_at_all_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"missing\.rrd"):
        merge([tmp_path / "missing.rrd"], tmp_path / "mission.rrd")
