"""`hil reproduce` with small numbers: jobs, lines on disk, tables."""

import json
import math

import numpy as np
import pytest

from base_station.planning.attempts import Attempt, derived_seed
from base_station.planning.laboratory import measure as measuring
from base_station.planning.laboratory import reproduce as reproducing
from base_station.planning.laboratory.changes import (
    changed_mission,
    changed_problem,
    changed_view,
)
from base_station.planning.laboratory.jobs import (
    ABLATIONS,
    MISSION_ABLATIONS,
    STUDIES,
    Job,
    jobs,
)
from base_station.planning.laboratory.measure import measure, row_of_three
from base_station.planning.laboratory.reproduce import reproduce
from base_station.planning.laboratory.results import Results
from base_station.planning.laboratory.tables import report, table, wilson
from base_station.planning.problems import alpha_problem, beta_problem
from hil.cli import main
from hil.errors import InputError

JOB = Job("ladder", "near", "ram", "tuned", 3)


def test_wilsons_interval_is_the_published_one():
    """Brown, Cai, DasGupta (2001): 0 of 10 gives 0 to 0.278; and it holds its end points."""
    low, high = wilson(0, 10)
    assert (low, high) == (pytest.approx(0.0, abs=1e-12), pytest.approx(0.2775, abs=1e-3))
    for successes, count in ((47, 50), (39, 50), (5, 5)):
        for end in wilson(successes, count):
            if 0.0 < end < 1.0:
                z = (successes / count - end) / math.sqrt(end * (1 - end) / count)
                assert abs(z) == pytest.approx(1.96, abs=1e-6)
    with pytest.raises(ValueError, match="nothing"):
        wilson(0, 0)


def test_every_job_is_its_own_and_early_ones_cover_all_tables():
    everything = list(jobs(STUDIES, 3))
    assert len({job.key for job in everything}) == len(everything)
    first = list(jobs(STUDIES, 1))
    assert everything[: len(first)] == first
    assert {job.study for job in first} == set(STUDIES)


def test_what_was_done_is_found_again_and_a_cut_line_is_dropped(tmp_path):
    results = Results(tmp_path / "deep" / "results.jsonl")
    assert results.read() == {}
    results.add(JOB, {"accepted": True})
    with results.path.open("a") as file:
        file.write('{"key": "half')
    assert results.read() == {JOB.key: {"key": JOB.key, "accepted": True}}
    other = Job("ladder", "far", "ram", "tuned", 3)
    results.add(other, {"accepted": False})
    assert set(results.read()) == {JOB.key, other.key}


def test_a_file_of_something_else_is_refused(tmp_path):
    path = tmp_path / "results.jsonl"
    path.write_text("hello\nworld\n")
    with pytest.raises(InputError, match="line 1: not a result; move"):
        Results(path).read()
    assert path.read_text() == "hello\nworld\n"


def test_it_goes_on_where_it_was(rescue_view, tmp_path, monkeypatch):
    """A first run is stopped by its time; the second does the rest and nothing twice."""
    done = []

    def quick(_base, job, _restarts):
        done.append(job.key)
        return {"vehicles": job.number, "ns_per_step": 50.0 * job.number, "cpu_s": 0.0}

    monkeypatch.setattr(reproducing, "measure", quick)
    monkeypatch.setattr(reproducing.time, "monotonic", iter([0.0, 1.0, 2.0, 61.0]).__next__)
    reproduce(rescue_view, tmp_path, ("cost",), 5, 0, 1.0)
    assert len(done) == 2
    monkeypatch.setattr(reproducing.time, "monotonic", lambda: 0.0)
    text = reproduce(rescue_view, tmp_path, ("cost",), 5, 0, None)
    assert len(done) == len(set(done)) == 5
    assert "Exponent in the number of vehicles: 1.00" in text
    assert (tmp_path / "tables.md").read_text() == text


def test_tables_of_nothing_are_nothing():
    assert report({}) == ""
    assert table("t", ["a"], []) == ""


def test_a_rung_of_the_ladder(rescue_view):
    row = measure(rescue_view, Job("ladder", "near", "ram", "tuned", 0), 0)
    assert row["accepted"]
    assert row["information_low_bits"] > 0.9
    assert json.dumps(row)


def test_a_layout_is_learned_on_if_the_script_can_do_it(rescue_view, monkeypatch):
    """Missed targets are tried again with the planner's own seeds; the infeasible is not tried."""
    seeds = []

    def quick(_problem, _preset, seed, _progress):
        seeds.append(seed)
        return Attempt(len(seeds) == 2, 100, 0.0, ())

    monkeypatch.setattr(measuring, "taught_mission", quick)
    job = Job("layouts", "near", "ppo", "tuned", 3)
    row = measure(rescue_view, job, 5)
    assert row["scripted"] >= 0.75
    assert [attempt["accepted"] for attempt in row["attempts"]] == [False, True]
    assert seeds == [derived_seed(3, 0), derived_seed(3, 1)]
    short = rescue_view.planning.model_copy(update={"beta_horizon_s": 2.0})
    hopeless = measure(rescue_view.model_copy(update={"planning": short}), job, 5)
    assert (hopeless["scripted"], hopeless["attempts"]) == (0.0, [])
    text = report({job.key: row, Job("layouts", "near", "ppo", "tuned", 4).key: hopeless})
    assert "| near | 1 of 2 | 0 of 1 (0-79 %) | 1 of 1 (21-100 %) |" in text


def test_jobs_can_be_chosen_by_their_key():
    chosen = jobs(STUDIES, 2, ("paper/near/ppo/*", "cost/*/30/none"))
    assert [job.key for job in chosen] == [
        "paper/near/ppo/tuned/0/none",
        "paper/near/ppo/paper/0/none",
        "cost/twin/-/-/30/none",
        "paper/near/ppo/tuned/1/none",
        "paper/near/ppo/paper/1/none",
    ]


def test_both_plans_together_are_paired_by_number():
    """Only numbers that have both count; restarts are paid for."""
    rows = {
        Job("paper", "near", "ppo", "tuned", 0).key: _trained(1.0, 2.0),
        Job("paper", "near", "ppo", "tuned", 1).key: _trained(1.5),
        Job("paper", "beta", "ppo", "tuned", 0).key: _trained(6.0),
        Job("paper", "beta", "ppo", "paper", 1).key: _trained(60.0),
    }
    assert "| near + beta, ppo, tuned | 1 | 9.0 (9.0) |" in report(rows)


def _trained(*cpu_s):
    played = {"error": 0.0, "d_m": 1.0, "by_vehicle_m": [0.1, 0.9, 0.0]}
    one = {"accepted": True, "timesteps": 1, "curve": [], "mode": played, "sample": played}
    return {"attempts": [{"cpu_s": spent, **one} for spent in cpu_s]}


def test_the_cost_of_a_crowd(rescue_view, monkeypatch):
    monkeypatch.setattr(measuring, "TIMED_STEPS", 2_000)
    row = measure(rescue_view, Job("cost", "twin", "-", "-", 30), 0)
    assert row["vehicles"] == 30
    assert row["ns_per_step"] > 0.0


def test_every_ablation_changes_something(rescue_view):
    request = row_of_three(rescue_view, Job("ablation", "far", "ppo", "tuned", 0))
    plain = alpha_problem(rescue_view, request)
    for change in ABLATIONS[1:]:
        problem = changed_problem(alpha_problem(changed_view(rescue_view, change), request), change)
        same = (
            problem.declared == plain.declared,
            problem.start_sigma_m == plain.start_sigma_m,
            problem.near_starts == plain.near_starts,
            problem.period_s == plain.period_s,
            problem.commands == plain.commands,
        )
        assert same.count(False) == 1, change
    request = row_of_three(rescue_view, Job("ablation", "beta", "ppo", "tuned", 0))
    mission = beta_problem(rescue_view, request)
    for change in MISSION_ABLATIONS[1:]:
        changed = changed_mission(mission, change)
        assert (changed.shaped, changed.curriculum, changed.base) != (True, True, "delivered")


def test_a_training_tells_of_mode_sample_and_d(rescue_view, tmp_path):
    """One whole job of the paper's study, with table and figures' data."""
    job = Job("paper", "near", "ppo", "tuned", 0)
    row = measure(rescue_view, job, 0)
    (attempt,) = row["attempts"]
    assert attempt["accepted"]
    assert attempt["mode"]["d_m"] == pytest.approx(np.linalg.norm(attempt["mode"]["by_vehicle_m"]))
    assert attempt["mode"] != attempt["sample"]
    text = report({job.key: row})
    assert "| near, ppo, tuned | 1 of 1 (21-100 %) | 1 of 1 (21-100 %) |" in text
    assert "94 % (MLP)" in text
    told = [f"{d:.2f}" for d in attempt["mode"]["by_vehicle_m"]]
    assert f"| near, ppo, tuned | {' | '.join(told)} |" in text
    assert reproducing.figures.learning_curves({job.key: row}, tmp_path / "curves.svg")
    assert (tmp_path / "curves.svg").stat().st_size > 1000


def test_bad_numbers_are_one_line(capsys):
    assert main(["reproduce", "--trainings", "0"]) == 2
    assert "must be 1 or more" in capsys.readouterr().err
