"""The report of a campaign, into its folder."""

from collections.abc import Sequence
from pathlib import Path

from hil.bench.campaign.file import Campaign
from hil.bench.campaign.report.figures import figures
from hil.bench.campaign.report.page import page
from hil.bench.campaign.report.scores import choose
from hil.bench.campaign.row import Row

PAGE_FILE = "report.html"


def write_report(folder: Path, campaign: Campaign, rows: Sequence[Row]) -> Path:
    """The page, and its figures as PNGs in a folder beside it."""
    chosen = choose(campaign, rows)
    looks = [f"{after_s:g}" for after_s in campaign.look_after_s]
    drawn = figures(chosen.rows, looks) if chosen.rows else {}
    target = folder / PAGE_FILE
    beside = target.with_suffix("")
    beside.mkdir(exist_ok=True)
    for name, image in drawn.items():
        (beside / f"{name}.png").write_bytes(image)
    target.write_text(page(campaign, rows, chosen, drawn), encoding="utf-8")
    return target
