"""How figures look: the colours of the recordings, on the dark ground of the page."""

from collections.abc import Sequence
from io import BytesIO
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from base_station.recording.palette import PHASES, Rgb

GROUND, INK, DIM, LINES = "#14171c", "#e8eaee", "#8b929e", "#2a2f37"
WIDTH_IN, DPI = 9.6, 150
_PHASE_COLORS, _OTHER = dict(PHASES), (70, 74, 82)


def shade(color: Rgb) -> tuple[float, float, float]:
    """As matplotlib has it."""
    r, g, b = color
    return r / 255, g / 255, b / 255


def figure(height_in: float, rows: int = 1, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """An empty figure and its axes, in reading order."""
    made = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, facecolor=GROUND, layout="constrained")
    axes = made.subplots(rows, columns, squeeze=False)
    for one in axes.flat:
        one.set_facecolor(GROUND)
        one.grid(color=LINES, linewidth=0.6)
        one.set_axisbelow(True)
        one.tick_params(colors=DIM, labelsize=8, length=0)
        for spine in one.spines.values():
            spine.set_visible(False)
        one.xaxis.label.set(color=DIM, size=8.5)
        one.yaxis.label.set(color=DIM, size=8.5)
    return made, list(axes.flat)


def legend(axes: Axes, **where: Any) -> None:
    """Quiet."""
    axes.legend(fontsize=8, labelcolor=INK, facecolor=GROUND, edgecolor=LINES, **where)


def shade_phases(axes: Axes, phases: Sequence[tuple[str, float, float]], room: int) -> None:
    """The phases behind a plot over time, named above it where the name fits.

    `room` is how many letters fit over the whole plot.
    """
    whole_s = max(end for *_, end in phases) if phases else 0.0
    for name, begin, end in phases:
        color = shade(_PHASE_COLORS.get(name, _OTHER))
        axes.axvspan(begin, end, color=color, alpha=0.28, lw=0)
        if (end - begin) / whole_s * room > len(name):
            axes.annotate(
                name.replace("_", " "),
                ((begin + end) / 2, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(0, 4),
                textcoords="offset points",
                ha="center",
                color=DIM,
                fontsize=7,
            )


def png(drawn: Figure) -> bytes:
    """The figure as a file's content."""
    out = BytesIO()
    drawn.savefig(out, format="png")
    return out.getvalue()
