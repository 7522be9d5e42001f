"""What a person sees: every tab without a warning, pictures of the right size, a live viewer."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import recorder_fake_run as fake
from drawing import needs_vulkan

from base_station.recorder import Recorder
from base_station.recording.blueprint import TABS
from base_station.recording.merge import merge
from base_station.recording.screenshot import SIZE, Viewer, headless, screenshot
from base_station.recording.truth import TruthRecorder
from hil.errors import InputError

pytestmark = needs_vulkan


@pytest.fixture(scope="module")
def mission(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mission")
    story = list(fake.snapshots())
    station = Recorder(folder / "station.rrd", "demo", fake.view())
    truth = TruthRecorder(folder / "truth.rrd", "demo", fake.scenario())
    fake.tell(station, story)
    fake.tell_truth(truth, story)
    station.close()
    truth.close()
    merge([folder / "station.rrd", folder / "truth.rrd"], folder / "mission.rrd")
    return folder / "mission.rrd"


@pytest.fixture(scope="module")
def viewer(mission: Path) -> Iterator[Viewer]:
    with headless(mission) as viewer:
        yield viewer


def size(png: Path) -> tuple[int, int]:
    head = png.read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


TIMES_S = {"Overview": 18.0, "Diagnosis": 19.5, "Learning": 28.9, "Mission": 45.0}


@pytest.mark.parametrize("tab", TABS)
def test_no_view_of_any_tab_warns(viewer: Viewer, tmp_path: Path, tab: str) -> None:
    viewer.shoot(TIMES_S.get(tab, 60.0), tmp_path / "tab.png", tab)
    assert viewer.warnings() == []
    assert size(tmp_path / "tab.png") == SIZE


def test_tabs_and_times_look_different(viewer: Viewer, tmp_path: Path) -> None:
    pictures = set()
    for name, tab, time_s in (("a", "Overview", 3.0), ("b", "Overview", 45.0), ("c", "Log", 45.0)):
        viewer.shoot(time_s, tmp_path / name, tab)
        pictures.add((tmp_path / name).read_bytes())
    assert len(pictures) == 3


def test_one_view_by_its_title(viewer: Viewer, tmp_path: Path) -> None:
    viewer.shoot(45.0, tmp_path / "a.png", "Distance to goal")
    width, height = size(tmp_path / "a.png")
    assert 300 < width < SIZE[0]
    assert 100 < height < SIZE[1]


def test_one_call_for_one_picture(mission: Path, tmp_path: Path) -> None:
    screenshot(mission, 18.0, tmp_path / "a.png")
    assert size(tmp_path / "a.png") == SIZE


def test_an_unknown_view_is_named_with_those_there_are(viewer: Viewer, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"view 'Nonsense'.*Overview, Diagnosis"):
        viewer.shoot(1.0, tmp_path / "a.png", "Nonsense")


def test_a_live_viewer_sees_the_run(tmp_path: Path) -> None:
    with headless() as viewer:
        recorder = Recorder(tmp_path / "a.rrd", "live", fake.view(), viewer=viewer.address)
        fake.tell(recorder, list(fake.snapshots()))
        recorder.close()
        viewer.wait_for("live")
        viewer.shoot(18.0, tmp_path / "live.png", "Overview")
        assert viewer.warnings() == []
    assert recorder.failures == 0
