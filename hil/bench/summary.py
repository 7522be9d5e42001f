"""The summary at the end of a run, from the tree of result.json (pure)."""

from typing import Any

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from hil.bench.result import COMPLETED
from hil.scenario import Scenario

SHOWN_FROM = 0.0005  # what rounds to a posterior of 0.000 is not shown


def summary(tree: dict[str, Any], scenario: Scenario) -> RenderableType:
    """Verdict and truth on top, goals and phases side by side below."""
    if tree["ended"] != COMPLETED:
        return _panel("ended early", "red", Text(tree["ended"]))
    names = {str(v.sysid): v.name for v in scenario.fleet}
    below = Table.grid(padding=(0, 4))
    below.add_row(_goals(tree, names), _times(tree))
    parts: list[RenderableType] = [_verdict(tree, names), Text(), below]
    if tree["expected_met"]:
        return _panel("as expected", "green", *parts)
    reasons = (Text(f"- {reason}", style="red") for reason in tree["unmet"])
    return _panel("not as expected", "red", *parts, Text(), *reasons)


def _panel(title: str, colour: str, *parts: RenderableType) -> Panel:
    words = Text(title, style="bold")
    return Panel(Group(*parts), title=words, title_align="left", border_style=colour)


def _verdict(tree: dict[str, Any], names: dict[str, str]) -> RenderableType:
    grid = Table.grid(padding=(0, 2))
    verdict = tree["verdict"]
    if verdict is None:
        said = Text("nothing is wrong" if tree["alarm"] is False else "none")
    else:
        who = names.get(str(verdict["sysid"]), verdict["sysid"])
        what = verdict["hypothesis"] if verdict["decided"] else "cannot tell"
        said = Text(f"{who}: {what}", style="bold magenta")
        said.append(f"   {_posterior(verdict['posterior'])}", style="dim")
    truths = [f"{names[s]}: {h}" for s, h in tree["truth"]["hypotheses"].items()]
    right = tree["correct"]
    grid.add_row(Text("verdict", style="dim"), said)
    grid.add_row(Text("truth", style="dim"), ", ".join(truths) or "nothing is broken")
    grid.add_row(
        Text("score", style="dim"),
        Text("correct" if right else "not correct", style="bold green" if right else "bold red"),
    )
    return grid


def _posterior(posterior: dict[str, float]) -> str:
    ranked = sorted(posterior.items(), key=lambda item: -item[1])[:3]
    return "  ".join(f"{name} {p:.3f}" for name, p in ranked if p >= SHOWN_FROM)


def _goals(tree: dict[str, Any], names: dict[str, str]) -> RenderableType:
    table = _table("goal of", ("declared", "left"), ("at", "right"), ("true", "right"))
    for sysid, goal in tree["goals"].items():
        time_s = goal["time_s"]
        table.add_row(
            names[sysid],
            goal["declared"],
            "-" if time_s is None else f"{time_s:.1f} s",
            Text(
                f"{goal['final_distance_m']:.2f} m", style="green" if goal["reached"] else "yellow"
            ),
        )
    return table


def _times(tree: dict[str, Any]) -> RenderableType:
    table = _table("phase", ("fleet", "right"), ("wall", "right"), ("learning", "left"))
    trainings: dict[str, list[str]] = {}
    for t in tree["trainings"]:
        again = f", {t['restarts']} restarts" if t["restarts"] else ""
        words = f"{t['wall_s']:.1f} s, {t['timesteps'] / 1000:.0f}k steps{again}"
        trainings.setdefault(f"plan_{t['kind']}", []).append(words)
    for p in tree["phases"]:
        learnt = "\n".join(trainings.get(p["phase"], []))
        table.add_row(p["phase"], f"{p['sim_s']:.1f} s", f"{p['wall_s']:.1f} s", learnt)
    return table


def _table(first: str, *columns: tuple[str, Any]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", pad_edge=False)
    table.add_column(first)
    for name, justify in columns:
        table.add_column(name, justify=justify)
    return table
