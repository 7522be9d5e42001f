"""`base-station`: bad input is one line, exit code 2, and nothing is left."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from base_station.process import main
from hil.scenario import StationView

Edit = Callable[[dict[str, Any]], object]
BAD_VIEWS: dict[str, tuple[Edit, str]] = {
    "no fleet": (lambda t: t.update(fleet=[]), "fleet"),
    "sysid twice": (lambda t: t["fleet"][1].update(sysid=1), "used more than once"),
    "port twice": (lambda t: t["fleet"][1].update(mavlink_port=14550), "used more than once"),
    "name of another folder": (lambda t: t["fleet"][0].update(name="../evil"), "fleet.0.name"),
    "no twin": (lambda t: t["fleet"][0].update(airframe="quad_x"), "no twin of that"),
    "goal outside": (lambda t: t["fleet"][0]["goal"].update(north_m=99.0), "outside the arena"),
    "sysid of a vehicle": (lambda t: t.update(station_sysid=2), "is also a vehicle's"),
    "sysid too large": (lambda t: t.update(station_sysid=10**9), "station_sysid"),
    "negative seed": (lambda t: t.update(station_seed=-1), "station_seed"),
    "host of others": (lambda t: t.update(host="192.0.2.1"), "192.0.2.1"),
}


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """The one line on stderr with which the station is refused."""
    with pytest.raises(SystemExit) as exit_info:
        main(argv)
    assert exit_info.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("base-station: ")
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize(("edit", "words"), BAD_VIEWS.values(), ids=BAD_VIEWS.keys())
def test_bad_views(
    edit: Edit,
    words: str,
    rescue_view: StationView,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    tree = rescue_view.model_dump(mode="json")
    edit(tree)
    path = tmp_path / "view.json"
    path.write_text(json.dumps(tree))
    assert words in refused(capsys, str(path), "--out", str(tmp_path / "out"))
    assert list(tmp_path.iterdir()) == [path]


def test_bad_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert "--resume DIR" in refused(capsys)
    assert "--resume DIR" in refused(capsys, "view.json", "--resume", "there")
    assert "--colour" in refused(capsys, "view.json", "--colour")


def test_a_folder_that_cannot_be_made(
    rescue_view: StationView, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "view.json"
    path.write_text(rescue_view.model_dump_json())
    assert "--out" in refused(capsys, str(path), "--out", str(path))
