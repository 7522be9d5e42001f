"""Results as pictures: learning curves, and the trajectories of an experiment and of a rescue.

The suffix of a path says which format is written.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from numpy.typing import NDArray

from base_station.planning.laboratory.tables import groups
from base_station.planning.laboratory.trails import Meeting, Trails

Array = NDArray[np.float64]
Row = dict[str, Any]

mpl.rcParams["svg.hashsalt"] = "hil-fleet"  # the same picture is the same file
ACCEPTED, REJECTED = "#c1272d", "#3b6fb6"  # red and blue, as in the paper
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")  # Okabe and Ito
STYLES: tuple[Literal["-", "--", ":", "-."], ...] = ("-", "--", ":", "-.")  # by hypothesis
NAMES = {"ppo": "PPO (MLP)", "ppo_lstm": "PPO (LSTM)", "qtable": "Q-table", "dqn": "DQN"}
SMALL, DPI = 8, 110
AGAIN_M = 0.15  # meetings of the same two closer than this are circled once
ROUND_M = 0.22  # of the circle round a meeting


def learning_curves(rows: Mapping[str, Row], path: Path) -> bool:
    """Mean reward of an episode against time steps, for every attempt; False: nothing to draw."""
    found = {k: v for k, v in groups(rows, "paper").items() if k[0] in ("near", "far", "beta")}
    if not found:
        return False
    columns = 2 if len(found) == 4 else min(3, len(found))
    lines = -(-len(found) // columns)
    figure = Figure(figsize=(3.0 * columns, 2.3 * lines + 0.3), layout="constrained")
    for place, ((case, planner, preset, _), some) in enumerate(sorted(found.items()), start=1):
        axes = figure.add_subplot(lines, columns, place)
        attempts = [attempt for row in some for attempt in row["attempts"]]
        _curves(axes, attempts)
        good = sum(attempt["accepted"] for attempt in attempts)
        title = f"{case}, {NAMES.get(planner, planner)}, {preset}: {good} of {len(attempts)}"
        axes.set_title(title, fontsize=SMALL)
        if (place - 1) % columns == 0:
            axes.set_ylabel("reward of an episode", fontsize=SMALL)
        if place > len(found) - columns:
            axes.set_xlabel("thousand time steps", fontsize=SMALL)
    handles = [Line2D([], [], color=ACCEPTED), Line2D([], [], color=REJECTED)]
    figure.legend(
        handles, ["accepted", "rejected"], loc="outside lower center", ncols=2, fontsize=SMALL
    )
    _save(figure, path)
    return True


def _curves(axes: Axes, attempts: Sequence[Row]) -> None:
    """Rejected ones below; a dot where the target was met."""
    for attempt in sorted(attempts, key=lambda a: a["accepted"]):
        steps, reward = np.array(attempt["curve"] or [(0.0, 0.0)]).T
        colour = ACCEPTED if attempt["accepted"] else REJECTED
        axes.plot(steps / 1000.0, reward, color=colour, linewidth=0.6, alpha=0.6)
        if attempt["accepted"]:
            axes.plot(steps[-1] / 1000.0, reward[-1], ".", color=colour, markersize=3)
    _plain(axes)


def experiment(trails: Trails, names: Sequence[str], radii_m: Array, path: Path) -> None:
    """What each twin does, what it would report, and how far the reports part, by vehicle.

    `names` of the H hypotheses, `radii_m` [V].
    """
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    places = figure.subplot_mosaic([["true", "apart"], ["told", "apart"]], width_ratios=(1.7, 1.0))
    true, told, parted = (places[name] for name in ("true", "told", "apart"))
    _paths(true, trails.true_m, radii_m)
    _meetings(true, trails.meetings)
    _paths(told, trails.reported_m, radii_m)
    true.set_title("where the twins go (contacts circled)", fontsize=SMALL)
    told.set_title("what the station would receive", fontsize=SMALL)
    for axes in (true, told):
        _same_frame(axes, trails.true_m, radii_m)
    apart = np.linalg.norm(trails.reported_m[:, 1] - trails.reported_m[:, 0], axis=-1)
    for v in range(apart.shape[1]):
        parted.plot(trails.times_s, apart[:, v], color=_colour(v), label=f"rover {v + 1}")
    whole = np.linalg.norm(apart, axis=1)
    parted.plot(trails.times_s, whole, color="0.3", linewidth=0.8, linestyle=":", label="all: D")
    parted.set_title("distance of the reports, m", fontsize=SMALL)
    parted.set_xlabel("time, s", fontsize=SMALL)
    parted.legend(fontsize=SMALL, frameon=False)
    _plain(parted)
    handles = [Line2D([], [], color="0.3", linestyle=s) for s in STYLES[: len(names)]]
    figure.legend(handles, names, loc="outside lower center", ncols=len(names), fontsize=SMALL)
    _save(figure, path)


def rescue(trails: Trails, goals_m: Array, broken: int | None, radii_m: Array, path: Path) -> None:
    """A mission on the believed twin, contacts circled, goals [V, 2] as squares."""
    everything = np.concatenate([trails.true_m, np.broadcast_to(goals_m, trails.true_m.shape)])
    height, width = np.ptp(everything.reshape(-1, 2), axis=0) + 2.4 * float(radii_m.max())
    figure = Figure(figsize=(5.2, 5.2 * height / width + 0.5), layout="constrained")
    axes = figure.add_subplot()
    _paths(axes, trails.true_m, radii_m)
    _meetings(axes, trails.meetings)
    for v, (north, east) in enumerate(goals_m):
        axes.plot(east, north, "s", color=_colour(v), markersize=9, markerfacecolor="none")
    _same_frame(axes, everything, radii_m)
    duration_s, said = trails.times_s[-1], f"; rover {broken + 1} is broken" if broken else ""
    axes.set_title(f"{duration_s:.0f} s{said}; contacts circled, goals are squares", fontsize=SMALL)
    _save(figure, path)


def _paths(axes: Axes, points: Array, radii_m: Array) -> None:
    """`points` [T, H, V, 2]: lines, with the vehicles as discs at the start and at the end."""
    for v in range(points.shape[2]):
        colour, (north, east) = _colour(v), points[0, 0, v]
        axes.add_patch(Circle((east, north), radii_m[v], facecolor="none", edgecolor=colour))
        middle: dict[str, Any] = {"ha": "center", "va": "center", "weight": "bold", "zorder": 5}
        axes.annotate(str(v + 1), (east, north), fontsize=SMALL, color=colour, **middle)
        for h in range(points.shape[1]):
            north, east = points[:, h, v].T
            axes.plot(east, north, color=colour, linestyle=STYLES[h], linewidth=1.2)
            end = Circle((east[-1], north[-1]), radii_m[v], facecolor=colour, alpha=0.2)
            end.set(edgecolor="none")
            axes.add_patch(end)


def _meetings(axes: Axes, meetings: Sequence[Meeting]) -> None:
    """Circles; two that touch again nearly where they did get one."""
    drawn = list[Meeting]()
    for one in meetings:
        if any(
            one.pair == d.pair and np.hypot(*(one.place_m - d.place_m)) < AGAIN_M for d in drawn
        ):
            continue
        drawn.append(one)
        north, east = one.place_m
        axes.add_patch(
            Circle((east, north), ROUND_M, facecolor="none", edgecolor=ACCEPTED, linewidth=1.4)
        )


def _same_frame(axes: Axes, points: Array, radii_m: Array) -> None:
    flat, margin = points.reshape(-1, 2), 1.2 * float(np.max(radii_m))
    (south, west), (north, east) = flat.min(axis=0) - margin, flat.max(axis=0) + margin
    axes.set(xlim=(west, east), ylim=(south, north), aspect="equal")
    axes.set_xlabel("east, m", fontsize=SMALL)
    axes.set_ylabel("north, m", fontsize=SMALL)
    _plain(axes)


def _plain(axes: Axes) -> None:
    axes.tick_params(labelsize=SMALL - 1)
    axes.grid(linewidth=0.3, alpha=0.5)
    axes.spines[["top", "right"]].set_visible(False)


def _colour(v: int) -> str:
    return COLOURS[v % len(COLOURS)]


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=DPI, metadata={"Date": None} if path.suffix == ".svg" else None)
