"""`hil reproduce`: the paper's results and more, job by job, resumable at any moment."""

import logging
import time
from pathlib import Path

from base_station.planning.laboratory import figures, tables
from base_station.planning.laboratory.jobs import Job, Study, jobs
from base_station.planning.laboratory.measure import measure, row_of_three
from base_station.planning.laboratory.results import Results, Row
from base_station.planning.planner import plan
from base_station.planning.problems import alpha_problem, beta_problem
from hil.scenario import StationView

LOG = logging.getLogger("reproduce")


def reproduce(
    base: StationView,
    out: Path,
    studies: tuple[Study, ...],
    trainings: int,
    restarts: int,
    minutes: float | None,
) -> str:
    """Do what is not done yet, for at most so many minutes; write and return the tables.

    In `out`: results.jsonl, a line per job; tables.md; curves.svg, experiment.svg, rescue.svg.
    """
    results = Results(out / "results.jsonl")
    rows = results.read()
    wanted = list(jobs(studies, trainings))
    missing = [job for job in wanted if job.key not in rows]
    LOG.info("%d jobs, %d done before", len(wanted), len(wanted) - len(missing))
    ends_s = None if minutes is None else time.monotonic() + 60.0 * minutes
    for number, job in enumerate(missing, start=1):
        if ends_s is not None and time.monotonic() >= ends_s:
            LOG.info("time is up; the same command goes on from here")
            break
        row = measure(base, job, restarts)
        results.add(job, row)
        rows[job.key] = row
        LOG.info("%d of %d: %s, %.1f s", number, len(missing), job.key, row["wall_s"])
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
    if found is not None:
        figures.experiment(alpha_problem(base, asked), found, out / "experiment.svg")
    asked = row_of_three(base, home)
    policy = plan(base, asked, lambda _: None).policy
    if policy is not None:
        figures.rescue(beta_problem(base, asked), policy, out / "rescue.svg")
