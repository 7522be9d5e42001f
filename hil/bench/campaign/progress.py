"""How a campaign is getting on: a bar in a terminal, elsewhere a line now and then."""

from collections.abc import Iterable, Iterator

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from hil.bench.campaign.row import Row

LINES = 20  # of progress, where there is no terminal


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        return Text(rate(task.finished_speed or task.speed))


def rate(runs_per_s: float | None) -> str:
    """For people."""
    if not runs_per_s:
        return "- runs/min"
    return f"{60.0 * runs_per_s:.1f} runs/min"


def watched(rows: Iterable[Row], planned: int, done: int, console: Console) -> Iterator[Row]:
    """The same rows, counted as they come."""
    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _Rate(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )
    failed = 0
    with bar:
        task = bar.add_task("runs", total=planned, completed=done)
        for row in rows:
            yield row  # kept first, then shown
            done, failed = done + 1, failed + row.failed
            bar.update(task, advance=1, description=f"runs, {failed} failed" if failed else "runs")
            if (
                not console.is_terminal
                and (done * LINES) // planned > ((done - 1) * LINES) // planned
            ):
                remaining_s = bar.tasks[task].time_remaining
                left = "" if remaining_s is None else f", {remaining_s:.0f} s left"
                speed = rate(bar.tasks[task].speed)
                console.print(f"{done} of {planned} runs, {failed} failed, {speed}{left}")
