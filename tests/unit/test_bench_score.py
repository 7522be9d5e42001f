"""The score: verdict against truth, outcome against expectation."""

import json
from pathlib import Path
from typing import Any

import pytest
from bench_builders import outcome, record, rescue

from hil.bench.record import RunRecord
from hil.bench.result import COMPLETED, RESULT_FILE, result_tree, write_result
from hil.bench.score import score
from hil.scenario import Scenario

STUCK_EAST = {"vehicle": 2, "unit": "gps", "type": "stuck", "axes": ["east"]}


def with_faults(*faults: dict[str, Any], **expect: Any) -> Scenario:
    tree = rescue().model_dump()
    return Scenario.model_validate(tree | {"faults": faults, "expect": {"alarm": True, **expect}})


def verdict(hypothesis: str, sysid: int = 2, decided: bool = True) -> dict[str, Any]:
    return {
        "sysid": sysid,
        "hypothesis": hypothesis,
        "posterior": {hypothesis: 0.999},
        "decided": decided,
    }


def test_all_right() -> None:
    scenario = rescue()
    judged = score(scenario, record(scenario))
    assert judged.correct
    assert judged.expected_met
    assert judged.true_hypotheses == {2: "motor_y_off"}
    assert judged.goals[1].distance_m == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("said", "correct"),
    [
        (verdict("motor_y_off"), True),
        (verdict("gps_east_stuck"), False),
        (verdict("motor_y_off", sysid=1), False),
        (verdict("motor_y_off", decided=False), False),
        (verdict("none"), False),
        (None, False),
    ],
    ids=["right", "wrong", "another vehicle", "undecided", "cleared", "no verdict"],
)
def test_verdicts_on_a_broken_fleet(said: dict[str, Any] | None, correct: bool) -> None:
    scenario = rescue()
    assert score(scenario, record(scenario, outcome(verdict=said))).correct is correct


@pytest.mark.parametrize(
    ("said", "correct"),
    [(None, True), (verdict("none"), True), (verdict("motor_y_off"), False)],
    ids=["no verdict", "cleared", "blamed"],
)
def test_verdicts_on_a_healthy_fleet(said: dict[str, Any] | None, correct: bool) -> None:
    scenario = with_faults()
    assert score(scenario, record(scenario, outcome(verdict=said))).correct is correct


@pytest.mark.parametrize(
    ("fault", "name"),
    [
        ({"unit": "motor", "type": "off", "instances": [4, 3]}, "motor_y_off"),
        ({"unit": "motor", "type": "off", "instances": [1, 2]}, "motor_x_off"),
        ({"unit": "motor", "type": "off", "instances": [3]}, "unknown"),
        ({"unit": "motor", "type": "off"}, "unknown"),
        ({"unit": "gps", "type": "stuck", "axes": ["east"]}, "gps_east_stuck"),
        ({"unit": "gps", "type": "stuck", "axes": ["north", "east"]}, "gps_stuck"),
        ({"unit": "gps", "type": "stuck"}, "gps_stuck"),
        ({"unit": "motor", "type": "partial", "size": 0.5, "instances": [3, 4]}, "motor_y_partial"),
        ({"unit": "motor", "type": "locked", "instances": [3, 4]}, "unknown"),
    ],
)
def test_the_truth_has_the_name_the_station_would_give_it(fault: dict[str, Any], name: str) -> None:
    scenario = with_faults({"vehicle": 2, **fault})
    assert score(scenario, record(scenario)).true_hypotheses == {2: name}


@pytest.mark.parametrize(
    ("also", "alone"),
    [
        ({"unit": "gps", "type": "offset", "size": [1.0, 0.0, 0.0]}, "gps_offset"),
        ({"unit": "motor", "type": "partial", "instances": [1], "size": 0.5}, "unknown"),
        ({"unit": "esc", "type": "off"}, "unknown"),
    ],
)
def test_one_fault_more_is_another_truth(also: dict[str, Any], alone: str) -> None:
    off = {"vehicle": 2, "unit": "motor", "type": "off", "instances": [3, 4]}
    both = with_faults(off, {"vehicle": 2, **also})
    assert score(both, record(both)).true_hypotheses == {2: "unknown"}
    one = with_faults({"vehicle": 2, **also})
    assert score(one, record(one)).true_hypotheses == {2: alone}


def test_two_faults_of_a_pair_are_one_hypothesis() -> None:
    off = {"vehicle": 2, "unit": "motor", "type": "off"}
    scenario = with_faults({**off, "instances": [3]}, {**off, "instances": [4]})
    assert score(scenario, record(scenario)).true_hypotheses == {2: "motor_y_off"}


def test_a_fault_that_never_struck_is_not_the_truth() -> None:
    scenario = rescue()
    before = record(scenario, outcome(verdict=None))
    never = RunRecord(before.outcome, before.truth, before.contacts, ())
    judged = score(scenario, never)
    assert judged.true_hypotheses == {}
    assert judged.correct
    assert not judged.expected_met


def test_reached_is_believed_only_within_the_true_distance() -> None:
    scenario = rescue()
    assert score(scenario, record(scenario, off_by_m=0.29)).expected_met
    judged = score(scenario, record(scenario, off_by_m=0.31))
    assert not judged.expected_met
    assert judged.unmet[0] == (
        "goal of rover_1 is declared reached from 0.31 m away; at most 0.3 m is right"
    )


def test_an_allowed_uncertain_end_is_fine_and_another_is_not() -> None:
    goals = {1: ["reached"], 2: ["reached", "uncertain"]}
    scenario = with_faults(STUCK_EAST, goals=goals)
    told = {1: {"declared": "reached"}, 2: {"declared": "uncertain"}, 3: {"declared": "reached"}}
    right = outcome(verdict=verdict("gps_east_stuck"), goals=told)
    assert score(scenario, record(scenario, right)).expected_met
    told[1] = {"declared": "uncertain"}
    wrong = outcome(verdict=verdict("gps_east_stuck"), goals=told)
    assert score(scenario, record(scenario, wrong)).unmet == (
        "goal of rover_1 is uncertain instead of reached",
    )


def test_an_unexpected_alarm_and_a_missing_one() -> None:
    healthy = with_faults(alarm=False)
    quiet = outcome(alarm=False, verdict=None)
    assert score(healthy, record(healthy, quiet)).expected_met
    loud = outcome(alarm=True, verdict=None)
    assert score(healthy, record(healthy, loud)).unmet == ("an alarm was raised",)
    broken = rescue()
    assert "no alarm was raised" in score(broken, record(broken, quiet)).unmet


def test_a_wrong_verdict_is_never_as_expected() -> None:
    scenario = with_faults(STUCK_EAST, goals={})
    judged = score(scenario, record(scenario))
    assert judged.unmet == ("the verdict does not fit the truth (vehicle 2: gps_east_stuck)",)


def test_a_run_without_outcome_has_no_score() -> None:
    with pytest.raises(ValueError, match="cannot be scored"):
        score(rescue(), RunRecord(None, None, (), ()))


def test_result_json_holds_the_contract(tmp_path: Path) -> None:
    scenario = rescue("seed=5")
    run = record(scenario)
    write_result(tmp_path, result_tree(scenario, run, score(scenario, run), COMPLETED))
    assert [p.name for p in tmp_path.iterdir()] == [RESULT_FILE]
    tree = json.loads((tmp_path / RESULT_FILE).read_text())
    assert (tree["scenario"], tree["seed"]) == ("rescue", 5)
    assert tree["versions"]["hil-fleet"]
    assert tree["verdict"]["posterior"]["motor_y_off"] == 0.997
    assert tree["correct"] is tree["expected_met"] is True
    assert tree["truth"]["faults"][0]["instances"] == [3, 4]
    assert tree["goals"]["2"] == {
        "reached": True,
        "declared": "reached",
        "time_s": 30.0,
        "final_distance_m": 0.1,
    }
    assert tree["phases"][0] == {"phase": "probe", "wall_s": 3.0, "sim_s": 3.0}
    assert tree["trainings"][0]["restarts"] == 1
    assert tree["contacts"] == [
        {"bodies": ["rover_1", "rover_2"], "time_s": 12.0, "end_s": 14.0, "peak_impulse_ns": 3.25}
    ]


def test_a_run_that_ended_early_says_why() -> None:
    why = "world was killed by SIGKILL"
    tree = result_tree(rescue(), RunRecord(None, None, (), ()), None, why)
    assert (tree["ended"], tree["unmet"]) == (why, [why])
    assert tree["expected_met"] is tree["correct"] is False
    assert tree["verdict"] is None
