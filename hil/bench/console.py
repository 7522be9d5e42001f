"""What a person sees of a run: phases, learning, events; in a terminal live, elsewhere as lines."""

import os
import shutil
import sys
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

from rich.console import Console as Terminal
from rich.console import Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from hil.bench.lines import Progress, StationEvent, Tick
from hil.bench.summary import summary
from hil.scenario import Scenario

WIDTH = 100
REFRESH_S = 0.1
PHASES = {
    "connect": ("", "wait for the fleet"),
    "arm": ("", "arm"),
    "probe": ("[0a]", "probe: tiny displacements, one axis of one vehicle after the other"),
    "plan_alpha": ("[1]", "learn plan alpha, which tells the explanations apart"),
    "experiment": ("[2]", "drive plan alpha, compare with the twins"),
    "plan_beta": ("[3]", "learn plan beta, the mission under the verdict"),
    "mission": ("[4]", "drive plan beta"),
    "return": ("", "helpers return to their goals"),
    "hold": ("", "hold"),
    "done": ("", "done"),
}
_STYLES = {
    "anomaly": ("!", "bold yellow"),
    "hypotheses": ("?", "yellow"),
    "verdict": ("=", "bold magenta"),
    "goal": ("*", "bold green"),
    "contact": ("x", "blue"),
    "fault": ("#", "red"),
    "takeover": ("!", "bold red"),
    "plan": ("+", "cyan"),
    "training": ("+", "cyan"),
    "end": (".", "bold"),
}
_SPARKS = "▁▂▃▄▅▆▇█"


class Console:
    """Events scroll by; the live part below them is the phase, or the training with its reward."""

    def __init__(
        self, terminal: Terminal | None = None, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._out = terminal or Terminal(highlight=False, soft_wrap=False)
        if self._out.width > WIDTH or not self._out.is_terminal:
            self._out.width = WIDTH
        self._clock = clock
        self._live = Live(console=self._out, auto_refresh=False, transient=True)
        self._started_s = self._shown_s = clock()
        self._tick: Tick | None = None
        self._training: Training | None = None
        self._world_s = 0.0

    def __enter__(self) -> "Console":
        if self._out.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self._live.stop()

    def begin(self, scenario: Scenario, folder: Path, how: str) -> None:
        text = Text(" ".join(scenario.description.split()) or scenario.name)
        title = f"[bold]{scenario.name}[/]  seed {scenario.seed}, {how}"
        self._out.print(
            Panel(text, title=title, title_align="left", subtitle=str(folder), style="dim")
        )

    def say(self, text: str) -> None:
        """A line about the run itself, as starting and stopping."""
        self._out.print(Text(f"{'':9}  {text}", style="dim"))

    def tick(self, tick: Tick) -> None:
        self._tick = tick
        self._refresh()

    def event(self, event: StationEvent) -> None:
        self._training = None
        if event.kind == "phase":
            number, title = PHASES.get(event.text, ("", event.text))
            line = Text(f"{event.time_s:7.1f} s  ", style="dim")
            line.append(f"{number:<5}" if number else "", style="bold cyan")
            line.append(title, style="bold")
            self._out.print(line)
            return
        sign, style = _STYLES.get(event.kind, (" ", "dim"))
        line = Text(f"{event.time_s:7.1f} s  ", style="dim")
        line.append(f"  {sign} ", style=style)
        line.append(event.text, style=style)
        self._out.print(line, soft_wrap=False)

    def progress(self, progress: Progress) -> None:
        if self._training is None or not self._training.covers(progress):
            self._training = Training(progress.kind, progress.attempt)
        quarter = self._training.take(progress)
        if self._out.is_terminal:
            self._refresh()
        elif quarter:
            self._out.print(Text(f"{'':11}{self._training.words()}"))

    def end(self, tree: dict[str, Any], scenario: Scenario, recording: Path | None) -> None:
        """The summary of result.json, and how to open the recording."""
        self._live.stop()
        self._out.print(summary(tree, scenario))
        if recording is not None:
            line = Text("  look at it  ", style="dim").append(
                f"{called_as()} view {recording.parent}", style="bold cyan"
            )
            self._out.print(line, soft_wrap=True)

    def _refresh(self) -> None:
        now_s = self._clock()
        if not self._out.is_terminal or now_s - self._shown_s < REFRESH_S:
            return
        self._shown_s = now_s
        self._live.update(self._footer(now_s - self._started_s), refresh=True)

    def _footer(self, wall_s: float) -> RenderableType:
        phase = self._tick.phase if self._tick else "connect"
        sim_s = self._tick.time_s if self._tick else 0.0
        number, title = PHASES.get(phase, ("", phase))
        line = Table.grid(expand=True)
        line.add_column(ratio=1)
        line.add_column(justify="right", style="dim")
        line.add_row(
            Text(f"{number} {title}".strip(), style="bold cyan"),
            f"fleet {sim_s:.1f} s   wall {wall_s:.0f} s",
        )
        parts: list[RenderableType] = [Rule(style="dim"), line]
        if self._training is not None:
            parts.append(self._training.bar())
        return Group(*parts)


class Training:
    """One training as it goes: how far it is, and its reward over time."""

    def __init__(self, kind: str, attempt: int) -> None:
        self.kind, self.attempt = kind, attempt
        self._last: Progress | None = None
        self._rewards: deque[float] = deque(maxlen=24)
        self._quarters = 0

    def covers(self, progress: Progress) -> bool:
        return (self.kind, self.attempt) == (progress.kind, progress.attempt)

    def take(self, progress: Progress) -> bool:
        """Whether another quarter of it is done."""
        self._last = progress
        self._rewards.append(progress.mean_reward)
        quarters = int(4 * self._done())
        passed, self._quarters = quarters > self._quarters, quarters
        return passed

    def words(self) -> str:
        reward = self._last.mean_reward if self._last else 0.0
        return (
            f"learning {self.kind}, attempt {self.attempt + 1}: "
            f"{100 * self._done():.0f} %, reward {reward:.3g}"
        )

    def bar(self) -> RenderableType:
        line = Table.grid(padding=(0, 1))
        reward = self._last.mean_reward if self._last else 0.0
        line.add_row(
            f"PPO {self.kind}, attempt {self.attempt + 1}",
            ProgressBar(total=1.0, completed=self._done(), width=34),
            f"{100 * self._done():3.0f} %",
            Text(f"reward {reward:8.3g}", style="bold"),
            Text(sparkline(list(self._rewards)), style="green"),
        )
        return line

    def _done(self) -> float:
        if self._last is None or self._last.total_timesteps <= 0:
            return 0.0
        return min(1.0, self._last.timesteps / self._last.total_timesteps)


def sparkline(values: list[float]) -> str:
    """Values as bars between their least and their greatest."""
    finite = [v for v in values if abs(v) < float("inf")]
    if not finite:
        return ""
    low, span = min(finite), max(finite) - min(finite)
    steps = [(v - low) / span if span > 0 else 0.0 for v in finite]
    return "".join(_SPARKS[min(len(_SPARKS) - 1, int(s * len(_SPARKS)))] for s in steps)


def called_as() -> str:
    """How to type `hil` here: its name where PATH finds it, else the way to it from this folder."""
    program = Path(sys.argv[0])
    if program.name != "hil" or shutil.which("hil"):
        return "hil"
    return os.path.relpath(program)
