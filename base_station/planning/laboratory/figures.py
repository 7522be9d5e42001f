"""Results as pictures: learning curves, and the trajectories of an experiment and of a rescue."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from base_station.planning.laboratory.tables import groups
from base_station.planning.policy import act, to_setpoints
from base_station.planning.requests import OpenLoopPlan, PolicyWeights
from base_station.planning.tasks.alpha import AlphaProblem
from base_station.planning.tasks.beta import BetaProblem
from base_station.twin import EAST, NORTH, advance

Array = NDArray[np.float64]
Row = dict[str, Any]

mpl.rcParams["svg.hashsalt"] = "hil-fleet"  # the same picture is the same file
ACCEPTED, REJECTED = "tab:red", "tab:blue"  # as in the paper
COLOURS = ("tab:green", "tab:orange", "tab:purple", "tab:brown", "tab:pink", "tab:gray")
DRAWN_S = 0.1  # between points of a trajectory


def learning_curves(rows: Mapping[str, Row], path: Path) -> bool:
    """Mean reward of an episode against time steps, for every attempt; False: nothing to draw."""
    found = {k: v for k, v in groups(rows, "paper").items() if k[0] in ("near", "far", "beta")}
    if not found:
        return False
    columns = min(4, len(found))
    lines = -(-len(found) // columns)
    figure = Figure(figsize=(3.6 * columns, 2.8 * lines), layout="constrained")
    for place, ((case, planner, preset, _), some) in enumerate(found.items(), start=1):
        axes = figure.add_subplot(lines, columns, place)
        attempts = [attempt for row in some for attempt in row["attempts"]]
        for attempt in sorted(attempts, key=lambda a: a["accepted"]):
            steps, reward = np.array(attempt["curve"] or [(0.0, 0.0)]).T
            colour = ACCEPTED if attempt["accepted"] else REJECTED
            axes.plot(steps / 1000.0, reward, color=colour, linewidth=0.6, alpha=0.7)
        axes.set_title(f"{case}, {planner}, {preset}", fontsize=8)
        axes.set_xlabel("thousand steps", fontsize=7)
        axes.set_ylabel("reward of an episode", fontsize=7)
        axes.tick_params(labelsize=7)
    figure.savefig(path, metadata={"Date": None})
    return True


def experiment(problem: AlphaProblem, plan: OpenLoopPlan, path: Path) -> None:
    """Each twin's trajectories, true ones, with contacts circled."""
    start = problem.start.copy()
    hypotheses = len(start)
    states, points, hits = start, [start[..., NORTH : EAST + 1]], list[Array]()
    looks = round(problem.period_s / DRAWN_S)
    for setpoints in plan.setpoints:
        for _ in range(looks):
            moved = advance(
                problem.model,
                problem.model.nominal,
                problem.faults,
                states,
                np.repeat(setpoints[None], hypotheses, axis=0),
                problem.commands.driven,
                DRAWN_S,
            )
            states = moved.states
            points.append(states[..., NORTH : EAST + 1])
            hits += _touches(moved.impulses_ns, states)
    _draw(np.array(points), hits, None, path)


def rescue(problem: BetaProblem, policy: PolicyWeights, path: Path) -> None:
    """A mission on the nominal twin, with contacts circled and goals as squares."""
    states, delivered = problem.start[None].copy(), problem.delivered[None].copy()
    points, hits = [states[..., NORTH : EAST + 1]], list[Array]()
    looks = round(problem.period_s / DRAWN_S)
    for k in range(problem.steps):
        if delivered.all():
            break
        action = act(policy, problem.observe(states, delivered, np.array([k])))
        setpoints = to_setpoints(action, problem.commands)
        for _ in range(looks):
            moved = advance(
                problem.model,
                problem.model.nominal,
                problem.faults,
                states,
                setpoints,
                problem.commands.driven,
                DRAWN_S,
            )
            states = moved.states
            points.append(states[..., NORTH : EAST + 1])
            hits += _touches(moved.impulses_ns, states)
        delivered |= problem.arrived(states)
    _draw(np.array(points), hits, problem.goals_m, path)


def _touches(impulses: Array, states: Array) -> list[Array]:
    """The places [2] between vehicles that touch."""
    rows, a, b = np.nonzero(np.triu(impulses))
    places = states[..., NORTH : EAST + 1]
    return list(0.5 * (places[rows, a] + places[rows, b]))


def _draw(points: Array, hits: list[Array], goals: Array | None, path: Path) -> None:
    """`points` [T, H, V, 2]; the first hypothesis is solid, the others are dashed."""
    figure = Figure(figsize=(5.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for v in range(points.shape[2]):
        colour = COLOURS[v % len(COLOURS)]
        for h in range(points.shape[1]):
            north, east = points[:, h, v].T
            axes.plot(east, north, color=colour, linestyle="-" if h == 0 else "--", linewidth=1.2)
        north, east = points[0, 0, v]
        axes.plot(east, north, "o", color=colour)
        axes.annotate(f"({v + 1})", (east, north), textcoords="offset points", xytext=(5, 5))
        if goals is not None:
            axes.plot(goals[v, 1], goals[v, 0], "s", color=colour)
    if hits:
        north, east = np.array(hits[:: max(1, len(hits) // 6)]).T
        axes.plot(
            east, north, "o", markersize=16, markerfacecolor="none", color="tab:red", alpha=0.6
        )
    axes.set_aspect("equal")
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    figure.savefig(path, metadata={"Date": None})
