"""The figures of a report (pure: data in, PNG out)."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from base_station.recording.palette import (
    ACCEPTED,
    REJECTED,
    hypothesis_color,
    vehicle_color,
)
from hil.bench.report.record import RunTold
from hil.bench.report.style import DIM, GROUND, INK, LINES, figure, legend, png, shade, shade_phases
from hil.scenario import Rectangle as Area

MAX_RADIUS_M = 0.35
M_PER_SQRT_NS = 0.12
SHOWN_FROM = 0.01  # a hypothesis that never gets this likely is left out of the legend
CONTACT = "#ffffff"


def figures(run: RunTold) -> dict[str, bytes]:
    """All figures there is data for, by name, in the order of the page."""
    drawn = {"trajectories": trajectories(run)}
    if run.residuals["north"].times.size:
        drawn["residuals"] = residuals(run)
    if run.posterior.times.size:
        drawn["posterior"] = posterior(run)
    if run.curves:
        drawn["learning"] = learning(run)
    drawn["timings"] = timings(run)
    return drawn


def trajectories(run: RunTold) -> bytes:
    """Where everybody truly went and reported to be, from above; contacts circled."""
    made, [axes] = figure(6.6)
    axes.add_patch(_outline(run.scenario.arena, "-"))
    if run.scenario.geofence:
        axes.add_patch(_outline(run.scenario.geofence, "--"))
    for k, vehicle in enumerate(run.scenario.fleet):
        color = shade(vehicle_color(k))
        north, east = run.truth_m[:, k].T
        axes.plot(east, north, color=color, lw=2.2, label=vehicle.name, solid_capstyle="round")
        if run.reported_m.size:
            told_north, told_east = run.reported_m[:, k].T
            axes.plot(told_east, told_north, color=color, lw=0.7, ls=(0, (1, 2)))
        axes.plot(east[0], north[0], "o", color=color, ms=5, mfc="none")
        axes.add_patch(
            Circle((east[-1], north[-1]), vehicle.frame.radius_m, color=color, alpha=0.55)
        )
        goal = (vehicle.goal.east_m, vehicle.goal.north_m)
        axes.plot(*goal, marker="x", color=color, ms=9, mew=2.0)
    for contact in run.contacts:
        _contact(axes, contact.point_m, contact.peak_impulse_ns, contact.start_s, contact.end_s)
    axes.plot([], [], color=DIM, lw=0.9, ls=(0, (1, 2)), label="as reported")
    axes.plot([], [], "o", color=DIM, mfc="none", ms=5, ls="", label="start")
    axes.plot([], [], "x", color=DIM, ms=8, mew=2, ls="", label="goal")
    axes.plot([], [], "o", color=CONTACT, mfc="none", ms=10, ls="", label="contact")
    axes.set(xlabel="east (m)", ylabel="north (m)", aspect="equal")
    legend(axes, loc="center left", bbox_to_anchor=(1.02, 0.5))
    return png(made)


def _outline(area: Area, style: str) -> Rectangle:
    corner = (area.east_min_m, area.north_min_m)
    size = (area.east_max_m - area.east_min_m, area.north_max_m - area.north_min_m)
    return Rectangle(corner, *size, fill=False, edgecolor=DIM, lw=1.0, ls=style)


def _contact(
    axes: Axes, point_m: tuple[float, float], impulse_ns: float, start_s: float, end_s: float
) -> None:
    north_m, east_m = point_m
    radius_m = min(MAX_RADIUS_M, 0.1 + M_PER_SQRT_NS * float(np.sqrt(max(0.0, impulse_ns))))
    axes.add_patch(
        Circle((east_m, north_m), radius_m, fill=False, edgecolor=CONTACT, lw=1.6, zorder=5)
    )
    axes.annotate(
        f"{start_s:.1f} to {end_s:.1f} s\nup to {impulse_ns:.1f} N s",
        (east_m, north_m - radius_m),
        xytext=(0, -8),
        textcoords="offset points",
        ha="center",
        va="top",
        color=INK,
        fontsize=7.5,
        zorder=6,
        bbox={"boxstyle": "round,pad=0.2", "facecolor": GROUND, "edgecolor": "none", "alpha": 0.8},
    )


def residuals(run: RunTold) -> bytes:
    """Reports against the believed twin, and the statistic that raises the alarm."""
    made, axes = figure(5.6, rows=2, columns=2)
    span = max(1.5, *(1.1 * float(np.nanmax(np.abs(r.values))) for r in run.residuals.values()))
    highest = max(1.6 * run.threshold, *(float(np.nanmax(a.values)) for a in run.alarms.values()))
    for column, axis in enumerate(("north", "east")):
        above, below = axes[column], axes[2 + column]
        for k, vehicle in enumerate(run.scenario.fleet):
            color = shade(vehicle_color(k))
            residual, alarm = run.residuals[axis], run.alarms[axis]
            above.plot(residual.times, residual.values[:, k], lw=0.9, color=color)
            below.plot(alarm.times, alarm.values[:, k], lw=1.4, color=color, label=vehicle.name)
        below.axhline(run.threshold, color=INK, lw=1.0, ls="--", label="alarm threshold")
        above.set(ylabel=f"residual {axis} (σ)", xlim=(0, run.end_s), ylim=(-span, span))
        below.set(ylabel=f"alarm statistic {axis} (σ)", xlabel="time (s)", xlim=(0, run.end_s))
        below.set_ylim(0, 1.15 * highest)
        for one in (above, below):
            shade_phases(one, run.phases(), room=70 if one is above else 0)
            for event in run.of("anomaly"):
                one.axvline(event["time_s"], color=INK, lw=0.8, ls=":")
    legend(axes[2], loc="upper right", ncols=2)
    return png(made)


def posterior(run: RunTold) -> bytes:
    """What the station believes, over time."""
    made, [axes] = figure(3.0)
    series = run.posterior
    for k, name in enumerate(series.names):
        values = series.values[:, k]
        if np.nanmax(np.nan_to_num(values)) >= SHOWN_FROM:
            color = shade(hypothesis_color(name))
            axes.plot(series.times, values, color=color, lw=2.2, label=name, drawstyle="steps-post")
    shade_phases(axes, run.phases(), room=140)
    for contact in run.contacts:
        axes.axvline(contact.start_s, color=CONTACT, lw=0.8, ls=":")
    axes.axhline(run.scenario.diagnosis.decide_at, color=DIM, lw=0.8, ls="--")
    axes.set(ylabel="posterior probability", xlabel="time (s)", ylim=(-0.03, 1.05))
    axes.set_xlim(0, run.end_s)
    legend(axes, loc="center right")
    return png(made)


def learning(run: RunTold) -> bytes:
    """Reward over steps: accepted attempts in green, rejected ones in grey."""
    kinds = list(dict.fromkeys(curve.kind for curve in run.curves))
    made, axes = figure(3.0, columns=len(kinds))
    for one, kind in zip(axes, kinds, strict=True):
        for curve in (c for c in run.curves if c.kind == kind):
            style = (
                {"color": shade(ACCEPTED)}
                if curve.accepted
                else {"color": shade(REJECTED), "ls": "--"}
            )
            one.plot(curve.steps / 1e3, curve.rewards, lw=2.0, label=curve.name, **style)
        one.set(xlabel="thousand steps", ylabel=f"mean reward, plan {kind}")
        legend(one, loc="lower right")
    return png(made)


def timings(run: RunTold) -> bytes:
    """Time in each phase on the fleet's clock, and on the wall's."""
    made, [axes] = figure(3.4)
    phases = run.result["phases"]
    places = np.arange(len(phases))
    for key, label, shift, color in (
        ("sim_s", "fleet time", -0.2, ACCEPTED),
        ("wall_s", "wall time", 0.2, REJECTED),
    ):
        times = [p[key] for p in phases]
        bars = axes.barh(places + shift, times, height=0.36, color=shade(color), label=label)
        axes.bar_label(bars, fmt="%.1f", padding=3, color=DIM, fontsize=7)
    axes.set_yticks(places, [p["phase"].replace("_", " ") for p in phases], color=INK)
    axes.invert_yaxis()
    axes.grid(axis="y", visible=False)
    axes.grid(axis="x", color=LINES)
    axes.set(xlabel="time spent (s)")
    if phases:
        legend(axes, loc="lower right")
    return png(made)
