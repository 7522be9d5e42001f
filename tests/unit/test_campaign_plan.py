"""From a campaign's file to its runs: disjoint splits, draws, layouts, keys, and bad input."""

import itertools
import math
from pathlib import Path
from typing import Any

import pytest
from campaign_builders import planned, write

from hil import cli
from hil.bench.campaign.draws import draw_layout, drawn
from hil.bench.campaign.file import MAX_LAYOUTS, MAX_REPEATS, Campaign, Layouts, load_campaign
from hil.bench.campaign.plan import runs
from hil.errors import InputError
from hil.scenario import Scenario


def test_layouts_and_seeds_of_tuning_and_test_never_meet() -> None:
    """All of one split lie below all of the other, at the limits of the schema, too."""
    limits = {"layouts": {"count": MAX_LAYOUTS}, "repeats": MAX_REPEATS}
    tuning, test = (
        Campaign.model_validate({"name": "c", "scenario": "s", "split": split, **limits})
        for split in ("tuning", "test")
    )
    assert tuning.layout_number(MAX_LAYOUTS - 1) < test.layout_number(0)
    last = tuning.seed(MAX_LAYOUTS - 1, MAX_REPEATS - 1)
    assert last < test.seed(0, 0)
    assert test.seed(MAX_LAYOUTS - 1, MAX_REPEATS - 1) < 2**31
    first = [tuning.seed(i, r) for i, r in itertools.product(range(3), (0, 1, MAX_REPEATS - 1))]
    assert len(set(first)) == len(first)


def test_a_cross_runs_every_combination_in_every_layout_and_repetition(tmp_path: Path) -> None:
    _, specs = planned(
        tmp_path,
        repeats=2,
        grid={"fault": {"none": {"faults": []}, "y": {}}, "noise": {"low": {}, "high": {}}},
    )
    assert len(specs) == 2 * 2 * 4
    assert len({s.key for s in specs}) == len(specs)
    assert {(s.point["fault"], s.point["noise"], s.layout, s.repeat) for s in specs} == set(
        itertools.product(("none", "y"), ("low", "high"), (0, 1), (0, 1))
    )


def test_dealing_gives_each_layout_one_combination_and_each_combination_its_share(
    tmp_path: Path,
) -> None:
    _, specs = planned(tmp_path, layouts={"count": 6}, combine="deal")
    assert [s.layout for s in specs] == [0, 1, 2, 3, 4, 5]
    assert [s.point["fault"] for s in specs] == ["none", "motor_y_off"] * 3


def test_points_share_places_and_noise_and_layouts_do_not(tmp_path: Path) -> None:
    _, (healthy, broken, elsewhere, _) = planned(tmp_path)
    assert healthy.tree["fleet"] == broken.tree["fleet"] != elsewhere.tree["fleet"]
    assert healthy.tree["seed"] == broken.tree["seed"] != elsewhere.tree["seed"]


def test_a_key_tells_everything_that_decides_a_run(tmp_path: Path) -> None:
    path = write(tmp_path)
    campaign = load_campaign(path)
    base = runs(path, campaign, "a")[0].key
    assert runs(path, campaign, "a")[0].key == base
    assert runs(path, campaign, "b")[0].key != base
    for change in (
        {"planner": "ram"},
        {"split": "test"},
        {"limit_s": 60.0},
        {"random": {"sensors.gps_position_sigma_m": 0.03}},
        {"layouts": {"count": 2, "apart_m": 1.1}},
    ):
        assert planned(tmp_path, **change)[1][0].key != base


def test_overrides_reach_the_scenario_and_the_way_it_is_run(tmp_path: Path) -> None:
    grid = {
        "radio": {"lossy": {"radio.loss": 0.1}},
        "method": {"ours": {}, "ram": {"planner": "ram"}, "passive": {"planner": "passive"}},
    }
    _, specs = planned(tmp_path, layouts={"count": 1}, grid=grid)
    assert {s.scenario().radio[0].loss for s in specs} == {0.1}
    assert [s.how.planner for s in specs] == ["cem", "ram", "passive"]
    assert [s.scenario().planning.planner for s in specs] == ["cem", "ram", "ppo"]


def test_a_draw_depends_on_its_seed_and_place_only() -> None:
    value = {"faults": [{"size": [{"uniform": [0.2, 0.8]}], "vehicle": {"choice": [1, 2, 3]}}]}
    once, again = drawn(value, 7, "x"), drawn(value, 7, "x")
    assert once == again
    assert 0.2 <= once["faults"][0]["size"][0] <= 0.8
    assert once["faults"][0]["vehicle"] in (1, 2, 3)
    alone = drawn({"faults": [{"size": [{"uniform": [0.2, 0.8]}]}]}, 7, "x")
    assert alone["faults"][0]["size"] == once["faults"][0]["size"]
    assert drawn(value, 8, "x") != once


def test_draws_have_the_distribution_that_was_asked_for() -> None:
    def mean(value: Any) -> float:
        return sum(drawn(value, seed, "x") for seed in range(2000)) / 2000

    assert mean({"uniform": [1.0, 3.0]}) == pytest.approx(2.0, abs=4 * 0.577 / 2000**0.5)
    assert mean({"normal": [5.0, 2.0]}) == pytest.approx(5.0, abs=4 * 2.0 / 2000**0.5)
    logs = [math.log(drawn({"log_uniform": [0.01, 1.0]}, s, "x")) for s in range(2000)]
    assert sum(logs) / 2000 == pytest.approx(math.log(0.1), abs=4 * 1.33 / 2000**0.5)


@pytest.mark.parametrize("number", range(25))
def test_a_layout_keeps_its_distances(number: int, rescue: Scenario) -> None:
    rules = Layouts(count=1, apart_m=1.2, wall_m=0.4, travel_m=(2.0, 5.0))
    places = draw_layout(number, rules, rescue.arena, rescue.fleet)
    assert places == draw_layout(number, rules, rescue.arena, rescue.fleet)
    margin_m = rescue.fleet[0].frame.radius_m + 0.4 - 0.001
    for start, goal in places:
        assert 2.0 <= math.dist(start, goal) <= 5.0
        for north, east in (start, goal):
            assert rescue.arena.north_min_m + margin_m <= north
            assert north <= rescue.arena.north_max_m - margin_m
            assert rescue.arena.east_min_m + margin_m <= east
            assert east <= rescue.arena.east_max_m - margin_m
    for (start, goal), (other_start, other_goal) in itertools.combinations(places, 2):
        assert math.dist(start, other_start) >= 1.2
        assert math.dist(goal, other_goal) >= 1.2


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "unknown key": ({"sedes": 3}, "sedes = 3"),
    "no scenario": ({"scenario": "nowhere.yaml"}, "nowhere.yaml"),
    "bad split": ({"split": "both"}, "split = 'both'"),
    "bad override": ({"grid": {"a": {"b": {"radio.loss": 2.0}}}}, "radio.0.loss = 2.0"),
    "bad index": ({"random": {"fleet.7.sysid": 1}}, "random.fleet.7.sysid"),
    "bad draw": ({"random": {"radio.loss": {"uniform": [1]}}}, "radio.loss = {uniform: [1]}"),
    "bad how": ({"grid": {"a": {"b": {"stop": "never"}}}}, "stop = 'never'"),
    "no policy": ({"mission": "nobody.json"}, "mission = 'nobody.json'"),
    "no room": ({"layouts": {"count": 1, "apart_m": 50}}, "no room for rover_2"),
    "headline": ({"headline": {"fault": "gps"}}, "headline.fault = 'gps'"),
    "no grid points": ({"grid": {"a": {}}}, "grid.a"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_exit_code_2(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changes, words = BAD[case]
    path, out = write(tmp_path, **changes), tmp_path / "out"
    assert cli.main(["campaign", str(path), "--out", str(out)]) == InputError.exit_code
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1
    assert str(path) in told
    assert not out.exists()


def test_jobs_must_be_some(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["campaign", str(write(tmp_path)), "--jobs", "0"]) == 2
    assert "must be 1 or more" in capsys.readouterr().err
