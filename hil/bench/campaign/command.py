"""`hil campaign`: plan, run what has not been run, table, report."""

import os
import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hil.bench.campaign.backends import BACKENDS
from hil.bench.campaign.file import load_campaign
from hil.bench.campaign.journal import Journal
from hil.bench.campaign.plan import RunSpec, code_digest, runs
from hil.bench.campaign.progress import watched
from hil.bench.campaign.report.write import write_report
from hil.bench.campaign.row import Row
from hil.bench.campaign.table import write_table
from hil.errors import EXIT_AS_EXPECTED, EXIT_NOT_AS_EXPECTED

CAMPAIGN_FILE = "campaign.yaml"


@dataclass(frozen=True)
class CampaignOptions:
    """As on the command line; `out` None is runs/campaign-<name>, `jobs` None all cores."""

    out: Path | None = None
    jobs: int | None = None
    backend: str = "local"


def run_campaign(
    path: Path,
    options: CampaignOptions,
    work: Callable[[RunSpec], Row] | None = None,
    console: Console | None = None,
) -> int:
    """Returns 0, or 1 when the program failed in one of the runs. Raises InputError.

    Runs that are in the journal of `out` already are not done again; what was interrupted goes on.
    """
    campaign = load_campaign(path)
    specs = runs(path, campaign, code_digest())
    out = options.out or Path("runs") / f"campaign-{campaign.name}"
    said = console or Console()
    with Journal(out) as journal:
        shutil.copyfile(path, out / CAMPAIGN_FILE)
        left = [spec for spec in specs if spec.key not in journal.rows]
        said.print(_plan_line(campaign.name, out, len(specs), len(left), journal), soft_wrap=True)
        for row in watched(_rows(left, options, work), len(specs), len(specs) - len(left), said):
            journal.add(row)
        rows = [journal.rows[spec.key] for spec in specs]
    table = write_table(out, rows)
    page = write_report(out, campaign, rows)
    failed = [row for row in rows if row.failed]
    for row in failed[:3]:
        said.print(f"failed: {row.point}, layout {row.layout}: {row.error}", soft_wrap=True)
    said.print(f"{len(rows)} runs, {len(failed)} failed: {table}, {page}", soft_wrap=True)
    return EXIT_NOT_AS_EXPECTED if failed else EXIT_AS_EXPECTED


def _rows(
    left: list[RunSpec], options: CampaignOptions, work: Callable[[RunSpec], Row] | None
) -> Iterable[Row]:
    if not left:
        return ()
    if work is None:
        from hil.bench.campaign.worker import run_one  # imports torch

        work = run_one
    return BACKENDS[options.backend](work, left, options.jobs or os.cpu_count() or 1)


def _plan_line(name: str, out: Path, planned: int, left: int, journal: Journal) -> str:
    words = f"{name}: {planned} runs, {planned - left} done already, into {out}"
    others = len(journal.rows) - (planned - left)
    if others:
        words += f" ({others} there belong to another plan or program, and are left out)"
    return words
