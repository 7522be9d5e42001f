"""The page of a campaign: HTML with everything in it, no script and no network (pure)."""

import base64
import math
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from hil.bench.campaign.file import Campaign
from hil.bench.campaign.report import scores
from hil.bench.campaign.report.scores import Chosen, Forecasts, is_decided
from hil.bench.campaign.row import Row
from hil.bench.campaign.stats import (
    Array,
    Estimate,
    brier,
    by_cluster,
    fit_temperature,
    log_losses,
    proportion,
    tempered,
    upper_bound,
)
from hil.bench.labels import CANNOT_TELL, NONE, UNKNOWN
from hil.bench.report.page import STYLE

CAPTIONS = {
    "confusion": (
        "What was said of what",
        "Runs by truth (rows) and by what the station said (columns).",
    ),
    "risk_coverage": (
        "Risk and coverage",
        "Share of wrong favourites among the surest runs. The band is a 95 % interval, "
        "resampled by layout.",
    ),
    "calibration": (
        "Is 0.9 right nine times of ten?",
        "Bins of equal mass, at least 100 runs each where there are as many; Clopper-Pearson 95 %.",
    ),
    "times": ("How long it takes", "Simulation time. Dashed: the median."),
    "impulses": ("How hard they touched", "Between vehicles, from the truth. Dashed: the median."),
}
Cells = Sequence[object]


def page(campaign: Campaign, rows: Sequence[Row], chosen: Chosen, figures: dict[str, bytes]) -> str:
    """One document."""
    described = " ".join(campaign.description.split())
    about = ", ".join(f"{a} {n}" for a, n in campaign.headline.items()) or "all of them"
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>{escape(campaign.name)}: report of a campaign</title><style>{STYLE}</style></head><body>
<header><h1>{escape(campaign.name)}</h1><p>{escape(described)}</p>
<p class="dim">{len(rows)} runs, {len({r.layout for r in rows})} layouts ({campaign.split});
the figures are about {escape(about)}: {len(chosen.rows)} runs, {len(chosen.apart)} scored apart,
{len(chosen.failed)} failed. Intervals are 95 %.</p></header>
{_section("In short", _short(chosen.rows))}
{_section("By truth", _classes(chosen.rows))}
{_section("Pairs that cannot be told apart", _apart(campaign, chosen.apart))}
{_section("Beside it", _points(campaign, rows))}
{_section("Probabilities", _probabilities(chosen.rows))}
{"".join(_figure(name, image) for name, image in figures.items())}
{_section("Speed", _speed(chosen.rows))}
</body></html>
"""


def _short(rows: Sequence[Row]) -> str:
    listed = [r for r in rows if r.truth not in (NONE, UNKNOWN)]
    unlisted = [r for r in rows if r.truth == UNKNOWN]
    alarms, hours, per_hour = scores.false_alarms(rows)
    abrupt = [r for r in rows if (r.onset_s or 0.0) > 0.0]
    unnoticed = sum(r.alarm_s is None for r in abrupt)
    elsewhere = sum(r.said == UNKNOWN for r in listed)
    told: list[Cells] = [
        ("decided, macro average", _percent(scores.macro(rows, is_decided, lambda _: True))),
        (
            "right among decided, macro average",
            _percent(scores.macro(rows, lambda r: r.correct, is_decided)),
        ),
        ("wrong", _counted(sum(r.wrong for r in rows), len(rows))),
        ("'something else' on listed faults", _counted(elsewhere, len(listed))),
        (
            "unlisted faults: 'something else'",
            _counted(sum(r.said == UNKNOWN for r in unlisted), len(unlisted)),
        ),
        (
            "unlisted faults: 'cannot tell'",
            _counted(sum(r.said == CANNOT_TELL for r in unlisted), len(unlisted)),
        ),
        ("detection delay, median", _seconds(scores.quantile(rows, lambda r: r.delay_s, 0.5))),
        (
            "detection delay, 95th percentile",
            _seconds(scores.quantile(rows, lambda r: r.delay_s, 0.95)),
        ),
        ("abrupt faults without an alarm", _counted(unnoticed, len(abrupt))),
        ("alarm to verdict, median", _seconds(scores.quantile(rows, lambda r: r.judging_s, 0.5))),
        (
            "false alarms per vehicle-hour",
            f"{_plain(per_hour, 2)}; {alarms} in {hours:.2f} vehicle-hours",
        ),
        (
            "contact impulse, median of runs with contact",
            _plain(
                scores.quantile(rows, lambda r: r.contact_max_ns if r.contacts else None, 0.5), 2
            )
            + " N s",
        ),
    ]
    return _table(("", "value (95 %)"), told)


def _classes(rows: Sequence[Row]) -> str:
    told = [
        (c.name, c.runs, _percent(c.decided), _percent(c.right), c.wrong, f"{c.wrong_bound:.1%}")
        for c in scores.class_scores(rows)
    ]
    heads = ("truth", "runs", "decided", "right among decided", "wrong", "at most (one-sided)")
    return _table(heads, told)


def _apart(campaign: Campaign, rows: Sequence[Row]) -> str:
    """The right pair is as much as can be asked for."""
    told = []
    for pair in campaign.undiagnosable:
        mine = [r for r in rows if r.truth in pair]
        named = sum(r.said in pair for r in mine)
        unsure = sum(r.said == CANNOT_TELL for r in mine)
        wrong = sum(r.decided and r.said not in pair for r in mine)
        told.append((" / ".join(pair), len(mine), named, unsure, wrong))
    heads = ("pair", "runs", "one of the pair", "cannot tell", "decided for another")
    return _table(heads, told) if rows else ""


def _points(campaign: Campaign, rows: Sequence[Row]) -> str:
    """Right, undecided and wrong for each point of each axis, all else mixed; and constants."""
    whole, told = [r for r in rows if not r.failed], list[Cells]()
    for axis, points in campaign.grid.items():
        for name in points:
            mine = [r for r in whole if r.point[axis] == name]
            right, wrong = sum(r.correct for r in mine), sum(r.wrong for r in mine)
            share = _percent(proportion(right, len(mine)))
            told.append((f"{axis}: {name}", len(mine), share, wrong))
    for name, right_share in scores.constant_guesses(whole).items():
        told.append((name, len(whole), _percent(right_share), "-"))
    return _table(("", "runs", "right", "wrong"), told) if whole else ""


def _probabilities(rows: Sequence[Row]) -> str:
    seen = scores.forecasts(rows)
    if seen is None:
        return ""
    errors, sure, bound = scores.sure_errors(seen)
    temperature, scaled = _cross_fitted(seen)
    chances = {
        "station": seen.chances,
        f"scaled by its temperature ({temperature:.2f})": scaled,
        "prior": seen.prior,
    }
    told = []
    for name, p in chances.items():
        losses = log_losses(p, seen.truth)
        mean_loss = by_cluster(lambda k: float(losses[k].mean()), seen.layouts)  # noqa: B023
        told.append((name, _plain(mean_loss, 3), _plain(_skill(seen, p), 3)))
    words = (
        f"<p>{len(seen.truth)} runs with a suspect. Among {sure} posteriors of {scores.SURE} and "
        f"more, {errors} were wrong: at most {bound:.1%} (one-sided 95 %).</p>"
    )
    return words + _table(("", "log loss (nats)", "Brier skill against the prior"), told)


def _skill(seen: Forecasts, chances: Array) -> Estimate:
    """1 - Brier score over that of the prior."""
    squares, reference = brier(chances, seen.truth), brier(seen.prior, seen.truth)

    def skill(picked: NDArray[np.intp]) -> float:
        return float(1.0 - squares[picked].mean() / max(1e-12, reference[picked].mean()))

    return by_cluster(skill, seen.layouts)


def _cross_fitted(seen: Forecasts) -> tuple[float, Array]:
    """Each half of the layouts at the temperature of the other one; the mean of both."""
    half = np.array(seen.layouts) % 2
    scaled, found = seen.chances.copy(), []
    for k in (0, 1):
        fit = half != k if (half != k).any() else half == k
        found.append(fit_temperature(seen.chances[fit], seen.truth[fit]))
        scaled[half == k] = tempered(seen.chances[half == k], found[-1])
    return float(np.mean(found)), scaled


def _speed(rows: Sequence[Row]) -> str:
    fleet_s = sum(r.fleet_s for r in rows)
    cpu_s, planning_s = sum(r.cpu_s for r in rows), sum(r.planning_cpu_s for r in rows)
    if cpu_s <= planning_s:
        return ""
    return (
        f"<p>{fleet_s / 3600:.2f} h of fleet time in {cpu_s / 3600:.2f} h of CPU time, of which "
        f"{planning_s / 3600:.2f} h planning; planning left out, "
        f"{fleet_s / (cpu_s - planning_s):.1f} times real time on one core.</p>"
    )


def _counted(hits: int, trials: int) -> str:
    if not trials:
        return "-"
    estimate, bound = proportion(hits, trials), upper_bound(hits, trials)
    return f"{hits} of {trials}: {_percent(estimate)}, one-sided at most {bound:.1%}"


def _percent(e: Estimate) -> str:
    return "-" if math.isnan(e.value) else f"{e.value:.1%} ({e.low:.1%} to {e.high:.1%})"


def _seconds(e: Estimate) -> str:
    return "-" if math.isnan(e.value) else f"{_plain(e, 2)} s"


def _plain(e: Estimate, digits: int) -> str:
    if math.isnan(e.value):
        return "-"
    return f"{e.value:.{digits}f} ({e.low:.{digits}f} to {e.high:.{digits}f})"


def _table(heads: Sequence[str], rows: Sequence[Cells]) -> str:
    head = "".join(f"<th>{escape(h)}</th>" for h in heads)
    body = "".join(
        f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows
    )
    return f"<table><tr>{head}</tr>{body}</table>"


def _section(title: str, inside: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{inside}</section>" if inside else ""


def _figure(name: str, image: bytes) -> str:
    title, caption = CAPTIONS[name]
    data = base64.b64encode(image).decode()
    return _section(
        title,
        f"<figure><figcaption>{escape(caption)}</figcaption>"
        f'<img alt="{escape(title)}" src="data:image/png;base64,{data}"></figure>',
    )
