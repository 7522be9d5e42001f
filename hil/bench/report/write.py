"""The report of a run, into its folder."""

from pathlib import Path

from hil.bench.report.figures import figures
from hil.bench.report.page import page
from hil.bench.report.record import read_run

PAGE_FILE = "report.html"


def write_report(folder: Path, out: Path | None = None) -> Path:
    """The page, and its figures as PNGs in a folder beside it. Raises InputError."""
    run = read_run(folder)
    drawn = figures(run)
    target = out or folder / PAGE_FILE
    beside = target.with_suffix("")
    beside.mkdir(parents=True, exist_ok=True)
    for name, image in drawn.items():
        (beside / f"{name}.png").write_bytes(image)
    target.write_text(page(run, drawn), encoding="utf-8")
    return target
