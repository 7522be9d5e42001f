"""What a person sees: lines that fit, a summary that tells, no live part outside a terminal."""

from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from bench_builders import outcome, record, rescue
from rich.console import Console as Terminal

from hil.bench.console import WIDTH, Console, sparkline
from hil.bench.lines import Progress, StationEvent, Tick
from hil.bench.result import COMPLETED, result_tree
from hil.bench.score import score


def shown(interactive: bool, told: Any = None) -> str:
    """All that a run prints."""
    scenario, out = rescue(), StringIO()
    run = record(scenario, told)
    tree = result_tree(scenario, run, score(scenario, run), COMPLETED)
    clock = iter(range(1000))
    terminal = Terminal(file=out, force_terminal=interactive, width=140, highlight=False)
    with Console(terminal, lambda: float(next(clock))) as console:
        console.begin(scenario, Path("runs/rescue-x"), "real time")
        console.event(event("phase", "plan_alpha"))
        console.tick(Tick(type="tick", time_s=3.0, phase="plan_alpha"))
        for steps in range(0, 1001, 100):
            console.progress(progress(steps))
        console.event(event("verdict", "rover_2: motor_y_off"))
        console.end(tree, scenario, Path("runs/rescue-x/mission.rrd"))
    return out.getvalue()


def event(kind: str, text: str) -> StationEvent:
    return StationEvent(type="event", time_s=3.0, kind=kind, text=text)


def progress(steps: int) -> Progress:
    return Progress(
        type="progress",
        kind="alpha",
        attempt=0,
        timesteps=steps,
        total_timesteps=1000,
        mean_reward=steps / 1000,
    )


def test_plain_output_is_lines_without_control_codes() -> None:
    text = shown(interactive=False)
    assert "\x1b" not in text
    assert max(map(len, text.splitlines())) <= WIDTH
    assert "learn plan alpha" in text
    assert "learning alpha, attempt 1: 50 %, reward 0.5" in text
    assert text.count("learning alpha") == 4
    assert "as expected" in text
    assert text.rstrip().endswith("hil view runs/rescue-x")


def test_a_terminal_gets_a_bar_and_the_reward() -> None:
    text = shown(interactive=True)
    assert "PPO alpha, attempt 1" in text
    assert "▁▂" in text


def test_the_summary_names_what_went_wrong() -> None:
    goals = {s: {"declared": "unreached"} for s in (1, 2, 3)}
    text = shown(interactive=False, told=outcome(verdict=None, goals=goals))
    assert "not as expected" in text
    assert "not correct" in text
    assert "goal of rover_1 is unreached instead of reached" in text


@pytest.mark.parametrize(
    ("values", "bars"),
    [([], ""), ([1.0], "▁"), ([0.0, 1.0], "▁█"), ([0.0, float("inf"), 2.0, 1.0], "▁█▅")],
)
def test_sparkline(values: list[float], bars: str) -> None:
    assert sparkline(values) == bars
