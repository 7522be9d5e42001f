"""`hil reproduce`: the paper's results and more, job by job, resumable at any moment."""

import logging
import time
from pathlib import Path

from base_station.planning.laboratory import figures, tables
from base_station.planning.laboratory.jobs import LEARNERS, Job, Study, jobs
from base_station.planning.laboratory.measure import measure, row_of_three
from base_station.planning.laboratory.results import Results, Row
from base_station.planning.laboratory.trails import of_experiment, of_mission
from base_station.planning.planner import plan
from base_station.planning.problems import alpha_problem, beta_problem
from base_station.planning.process import warm_up
from base_station.planning.requests import PolicyWeights
from hil.scenario import StationView

LOG = logging.getLogger("reproduce")


def reproduce(
    base: StationView,
    out: Path,
    studies: tuple[Study, ...],
    trainings: int,
    restarts: int,
    minutes: float | None,
    only: tuple[str, ...] = ("*",),
) -> str:
    """Do what is not done yet, for at most so many minutes; write and return the tables.

    In `out`: results.jsonl, a line per job; tables.md; curves.svg, experiment.svg, rescue.svg.
    """
    results = Results(out / "results.jsonl")
    rows = results.read()
    wanted = jobs(studies, trainings, only)
    missing = [job for job in wanted if job.key not in rows]
    LOG.info("%d jobs, %d done before", len(wanted), len(wanted) - len(missing))
    if any(job.planner in LEARNERS for job in missing):
        warm_up(base)
    ends_s = None if minutes is None else time.monotonic() + 60.0 * minutes
    for number, job in enumerate(missing, start=1):
        if ends_s is not None and time.monotonic() >= ends_s:
            LOG.info("time is up; the same command goes on from here")
            break
        row = measure(base, job, restarts)
        results.add(job, row)
        rows[job.key] = row
        LOG.info("%d of %d: %s, %.1f CPU s", number, len(missing), job.key, row["cpu_s"])
    text = tables.report({job.key: rows[job.key] for job in wanted if job.key in rows})
    (out / "tables.md").write_text(text, encoding="utf-8")
    if "paper" in studies:
        _figures(base, out, rows)
    return text


def _figures(base: StationView, out: Path, rows: dict[str, Row]) -> None:
    figures.learning_curves(rows, out / "curves.svg")
    near, home = Job("paper", "near", "ppo", "tuned", 0), Job("paper", "beta", "ppo", "tuned", 0)
    asked = row_of_three(base, near)
    found = plan(base, asked, lambda _: None).plan
    problem, names = alpha_problem(base, asked), [h.name for h in asked.hypotheses]
    radii_m = problem.model.vehicles.radius_m
    if found is not None:
        trails = of_experiment(problem, found)
        figures.experiment(trails, names, radii_m, out / "experiment.svg")
    asked = row_of_three(base, home)
    mission, policy = beta_problem(base, asked), plan(base, asked, lambda _: None).policy
    if isinstance(policy, PolicyWeights):
        trails = of_mission(mission, policy)
        figures.rescue(trails, mission.goals_m, mission.broken, radii_m, out / "rescue.svg")
