"""Saved plans: found by what they were learned from, and by nothing else."""

import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from planning_scenes import experiment, planning

from base_station.planning import shelf as shelves
from base_station.planning.planner import plan
from base_station.planning.requests import encode
from base_station.planning.shelf import Shelf, default_folder, key
from hil.scenario import Scenario, StationView, station_view


@pytest.fixture
def view(rescue_view) -> StationView:
    return planning(rescue_view, planner="ram", restarts=0)


@pytest.fixture
def shelf(tmp_path) -> Shelf:
    return Shelf(tmp_path / "plans")


def test_a_plan_comes_back_to_the_bit_and_says_so(view, shelf):
    asked = experiment(view)
    assert shelf.find(view, asked) is None
    ready = plan(view, asked, lambda _: None)
    shelf.keep(view, asked, ready)
    found = shelf.find(view, replace(asked, number=9))
    assert found.reused
    assert found.number == 9
    assert encode(replace(found, number=1, reused=False)) == encode(ready)


def test_what_can_change_a_plan_changes_the_key(view):
    asked = experiment(view)
    moved = asked.states.copy()
    moved[0, 0, 0] = np.nextafter(moved[0, 0, 0], 1.0)
    limits = view.model_copy(update={"limits": view.limits.model_copy(update={"speed_mps": 0.9})})
    keys = [
        key(view, asked),
        key(view, replace(asked, states=moved)),
        key(view, replace(asked, preset="paper")),
        key(view, replace(asked, seed=8)),
        key(view, replace(asked, posterior=(0.4, 0.6))),
        key(planning(view, planner="cem"), asked),
        key(limits, asked),
    ]
    assert len(set(keys)) == len(keys)


def test_what_can_not_does_not(view, rescue: Scenario):
    """Ports are picked anew for every run. And the fault, which the station does not know."""
    asked = experiment(view)
    same = key(view, replace(asked, number=4))
    assert key(planning(view, workers=3, planning_sim_s=0.0), asked) == same
    no_fault = rescue.model_copy(update={"faults": (), "seed": 99, "name": "another"})
    other = station_view(no_fault, mavlink_port_base=20_000, station_seed=5)
    assert key(planning(other, planner="ram", restarts=0), asked) == same


def test_new_code_learns_anew(view, monkeypatch):
    before = key(view, experiment(view))
    monkeypatch.setattr(shelves, "code_version", lambda: "other")
    assert key(view, experiment(view)) != before


@pytest.mark.parametrize("damage", ["cut", "changed", "other"])
def test_a_damaged_file_is_named_and_learned_anew(view, shelf, caplog, damage):
    asked = experiment(view)
    shelf.keep(view, asked, plan(view, asked, lambda _: None))
    (path,) = shelf.folder.iterdir()
    text = path.read_text()
    tree = json.loads(text)
    if damage == "changed":
        tree["ready"] = tree["ready"].replace('"period_s": 0.5', '"period_s": 5.0')
        assert tree["ready"] != json.loads(text)["ready"]
    changed = {"cut": text[:-99], "changed": json.dumps(tree), "other": "[1]"}
    path.write_text(changed[damage])
    with caplog.at_level(logging.WARNING):
        assert shelf.find(view, asked) is None
    assert str(path) in caplog.text
    assert "learning anew" in caplog.text


def test_failures_are_not_kept_and_a_full_shelf_drops_the_oldest(view, shelf, monkeypatch):
    asked = experiment(view)
    ready = plan(view, asked, lambda _: None)
    shelf.keep(view, asked, replace(ready, plan=None))
    assert not shelf.folder.exists()
    monkeypatch.setattr(shelves, "KEPT", 2)
    for seed in range(4):
        shelf.keep(view, replace(asked, seed=seed), ready)
    assert len(list(shelf.folder.iterdir())) == 2


def test_a_folder_that_can_not_be_written_is_named(view, tmp_path, caplog):
    (tmp_path / "file").write_text("")
    asked = experiment(view)
    Shelf(tmp_path / "file" / "plans").keep(view, asked, plan(view, asked, lambda _: None))
    assert "not saved" in caplog.text


def test_the_folder_follows_the_desktop_standard(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert default_folder() == tmp_path / "hil-fleet" / "plans"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert default_folder().parts[-3:] == (".cache", "hil-fleet", "plans")
