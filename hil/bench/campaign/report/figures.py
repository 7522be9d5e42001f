"""The figures of a campaign's report (pure: rows in, PNG out)."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from base_station.recording.palette import GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILION
from hil.bench.campaign.report import scores
from hil.bench.campaign.report.scores import Forecasts
from hil.bench.campaign.row import Row
from hil.bench.campaign.stats import Array, calibration, risk_coverage
from hil.bench.report.style import DIM, GROUND, INK, figure, legend, png, shade

BAND_RESAMPLES = 300
HUES = (SKY_BLUE, ORANGE, GREEN, PURPLE, VERMILION)


def figures(rows: Sequence[Row], looks: Sequence[str]) -> dict[str, bytes]:
    """All figures there are data for, by name, in the order of the page."""
    drawn = {"confusion": confusion(rows)}
    at_end = scores.forecasts(rows)
    if at_end:
        drawn["risk_coverage"] = risk(at_end)
        drawn["calibration"] = reliability({"at the end": at_end} | _looked(rows, looks))
    if any(r.delay_s is not None or r.judging_s is not None for r in rows):
        drawn["times"] = times(rows)
    if any(r.contacts for r in rows):
        drawn["impulses"] = impulses(rows)
    return drawn


def _looked(rows: Sequence[Row], looks: Sequence[str]) -> dict[str, Forecasts]:
    seen = {f"{look} s after the alarm": scores.forecasts(rows, look) for look in looks}
    return {name: s for name, s in seen.items() if s is not None}


def confusion(rows: Sequence[Row]) -> bytes:
    """Truth against what was said, counts in the cells, shades by the share of the row."""
    truths, said, counts = scores.confusion(rows)
    made, [axes] = figure(1.6 + 0.42 * len(truths))
    shares = counts / np.maximum(1, counts.sum(axis=1, keepdims=True))
    axes.imshow(shares, cmap="cividis", vmin=0.0, vmax=1.0, aspect="auto")
    for (i, j), count in np.ndenumerate(counts):
        if count:
            ink = GROUND if shares[i, j] > 0.6 else INK
            axes.text(j, i, str(count), ha="center", va="center", color=ink, fontsize=8)
    axes.grid(visible=False)
    axes.set_xticks(range(len(said)), said, rotation=35, ha="right")
    axes.set_yticks(range(len(truths)), truths)
    axes.set(xlabel="said", ylabel="truth")
    return png(made)


def risk(seen: Forecasts) -> bytes:
    """Share of errors among the surest, over how many are taken; band by layout."""
    made, [axes] = figure(3.4)
    wrong = (~seen.right).astype(np.float64)
    coverage, line = risk_coverage(seen.confidence, wrong)
    low, high = _band(seen, wrong, coverage)
    axes.fill_between(coverage, low, high, color=shade(SKY_BLUE), alpha=0.3, lw=0, label="95 %")
    axes.plot(coverage, line, color=shade(SKY_BLUE), lw=2.2, marker="o", ms=2.5)
    axes.set(xlabel="coverage (share of runs, the surest first)", ylabel="risk (share wrong)")
    axes.set(xlim=(0, 1.02), ylim=(-0.01, max(0.06, 1.15 * float(high.max()))))
    legend(axes, loc="upper left")
    return png(made)


def _band(seen: Forecasts, wrong: Array, coverage: Array) -> tuple[Array, Array]:
    layouts = np.array(seen.layouts)
    members = [np.flatnonzero(layouts == k) for k in np.unique(layouts)]
    rng, curves = np.random.default_rng(0), []
    for _ in range(BAND_RESAMPLES):
        picked = np.concatenate([members[k] for k in rng.integers(len(members), size=len(members))])
        x, y = risk_coverage(seen.confidence[picked], wrong[picked])
        curves.append(np.interp(coverage, x, y))
    low, high = np.percentile(curves, [2.5, 97.5], axis=0)
    return low, high


def reliability(all_seen: dict[str, Forecasts]) -> bytes:
    """How often the favourite was right, over how sure the station was; equal-mass bins."""
    made, [axes] = figure(3.8)
    axes.plot([0, 1], [0, 1], color=DIM, lw=0.9, ls="--")
    for hue, (name, seen) in zip(HUES, all_seen.items(), strict=False):
        bins = calibration(seen.confidence, seen.right)
        x, y = [b.confidence for b in bins], [b.right.value for b in bins]
        low = [b.right.value - b.right.low for b in bins]
        high = [b.right.high - b.right.value for b in bins]
        label = f"{name} ({len(seen.truth)} runs)"
        axes.errorbar(x, y, (low, high), fmt="o-", color=shade(hue), ms=4, lw=1.2, label=label)
    axes.set(xlabel="posterior of the favourite", ylabel="share right", ylim=(-0.03, 1.03))
    legend(axes, loc="lower right")
    return png(made)


def times(rows: Sequence[Row]) -> bytes:
    """How many were through by when."""
    made, (left, right) = figure(3.0, columns=2)
    _share_by(left, rows, lambda r: r.delay_s, "from onset to alarm (s)")
    _share_by(right, rows, lambda r: r.judging_s, "from alarm to verdict (s)")
    return png(made)


def impulses(rows: Sequence[Row]) -> bytes:
    """How hard vehicles touched each other."""
    made, (left, right) = figure(3.0, columns=2)
    touched = [r for r in rows if r.contacts]
    _share_by(left, touched, lambda r: r.contact_max_ns, "largest impulse of one step (N s)")
    _share_by(right, touched, lambda r: float(r.contacts), "contacts in a run")
    return png(made)


def _share_by(
    axes: Axes, rows: Sequence[Row], value: Callable[[Row], float | None], label: str
) -> None:
    told = np.sort([v for r in rows if (v := value(r)) is not None])
    if told.size:
        axes.step(
            told, np.arange(1, told.size + 1) / told.size, where="post", color=shade(SKY_BLUE)
        )
        axes.axvline(float(np.median(told)), color=DIM, lw=0.8, ls="--")
    axes.set(xlabel=label, ylabel=f"share of {told.size} runs", ylim=(0, 1.03))
