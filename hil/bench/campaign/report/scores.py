"""The numbers of a campaign's report, from its rows (pure)."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hil.bench.campaign.file import Campaign
from hil.bench.campaign.row import Row
from hil.bench.campaign.stats import Array, Estimate, by_cluster, proportion, rate, upper_bound
from hil.bench.labels import CANNOT_TELL, NO_ALARM, NONE, UNKNOWN

SURE = 0.99
S_PER_H = 3600.0


@dataclass(frozen=True)
class Chosen:
    """The rows the report is about, those of undiagnosable pairs, and those that failed."""

    rows: tuple[Row, ...]
    apart: tuple[Row, ...]
    failed: tuple[Row, ...]


@dataclass(frozen=True)
class ClassScore:
    """How runs of one truth came out. `wrong_bound` is one-sided, 95 %."""

    name: str
    runs: int
    decided: Estimate
    right: Estimate  # among decided
    wrong: int
    wrong_bound: float


def choose(campaign: Campaign, rows: Sequence[Row]) -> Chosen:
    """By the campaign's headline and its undiagnosable pairs."""
    headline = campaign.headline.items()
    mine = [r for r in rows if all(r.point.get(axis) == name for axis, name in headline)]
    pairs = {name for pair in campaign.undiagnosable for name in pair}
    whole = [r for r in mine if not r.failed]
    return Chosen(
        rows=tuple(r for r in whole if r.truth not in pairs),
        apart=tuple(r for r in whole if r.truth in pairs),
        failed=tuple(r for r in mine if r.failed),
    )


def is_decided(row: Row) -> bool:
    """A healthy fleet that raised no alarm was judged, too."""
    return row.correct or row.decided


def confusion(rows: Sequence[Row]) -> tuple[list[str], list[str], NDArray[np.int_]]:
    """Truths, what was said, and counts [truth, said]."""
    counts = Counter((r.truth, r.said) for r in rows)
    truths = sorted({r.truth for r in rows}, key=_order)
    said = sorted({r.said for r in rows} | set(truths), key=_order)
    table = [[counts[t, s] for s in said] for t in truths]
    return truths, said, np.array(table, dtype=np.int_).reshape(len(truths), len(said))


def class_scores(rows: Sequence[Row]) -> list[ClassScore]:
    """One per truth."""
    scores = []
    for name in sorted({r.truth for r in rows}, key=_order):
        mine = [r for r in rows if r.truth == name]
        decided, wrong = sum(map(is_decided, mine)), sum(r.wrong for r in mine)
        right = sum(r.correct for r in mine)
        scores.append(
            ClassScore(
                name,
                len(mine),
                proportion(decided, len(mine)),
                proportion(right, decided),
                wrong,
                upper_bound(wrong, len(mine)),
            )
        )
    return scores


def macro(rows: Sequence[Row], hit: Callable[[Row], bool], of: Callable[[Row], bool]) -> Estimate:
    """Mean over truths of the share of `hit` among `of`, resampled by layout."""
    truths = np.array([r.truth for r in rows])
    hits = np.array([hit(r) and of(r) for r in rows], dtype=np.float64)
    among = np.array([of(r) for r in rows], dtype=np.float64)

    def mean(picked: NDArray[np.intp]) -> float:
        shares = []
        for name in np.unique(truths[picked]):
            mine = picked[truths[picked] == name]
            if among[mine].sum():
                shares.append(hits[mine].sum() / among[mine].sum())
        return float(np.mean(shares)) if shares else float("nan")

    return by_cluster(mean, [r.layout for r in rows])


def quantile(rows: Sequence[Row], value: Callable[[Row], float | None], q: float) -> Estimate:
    """Of those rows that have the value, resampled by layout."""
    told = [(r.layout, v) for r in rows if (v := value(r)) is not None]
    values = np.array([v for _, v in told])
    return by_cluster(lambda k: float(np.quantile(values[k], q)), [layout for layout, _ in told])


def false_alarms(rows: Sequence[Row]) -> tuple[int, float, Estimate]:
    """Alarms on vehicles that were well then, their vehicle-hours, alarms per vehicle-hour."""
    alarms = sum(r.false_alarms for r in rows)
    hours = sum(r.healthy_vehicle_s for r in rows) / S_PER_H
    return alarms, hours, rate(alarms, hours)


@dataclass(frozen=True)
class Forecasts:
    """Posteriors [N, K] on suspects, what was true of these [N], and their layouts."""

    names: tuple[str, ...]
    chances: Array
    prior: Array
    truth: NDArray[np.intp]
    layouts: tuple[int, ...]

    @property
    def confidence(self) -> Array:
        return np.asarray(self.chances.max(axis=1))

    @property
    def right(self) -> NDArray[np.bool_]:
        return np.asarray(self.chances.argmax(axis=1) == self.truth)


def forecasts(rows: Sequence[Row], look: str | None = None) -> Forecasts | None:
    """At the end of each run, or at a look after the alarm; None when there are none."""
    told = [(r, p) for r in rows if (p := r.looks.get(look, {}) if look else r.posterior)]
    if not told:
        return None
    names = tuple(
        sorted(
            {n for r, p in told for n in (*p, *r.prior, r.suspect_truth)},
            key=_order,
        )
    )
    column = {name: k for k, name in enumerate(names)}

    def matrix(maps: Sequence[dict[str, float]]) -> Array:
        filled = np.zeros((len(maps), len(names)))
        for row, chances in enumerate(maps):
            for name, p in chances.items():
                filled[row, column[name]] = p
        sums = filled.sum(axis=1, keepdims=True)
        return np.where(sums > 0.0, filled / np.where(sums > 0.0, sums, 1.0), 1.0 / len(names))

    return Forecasts(
        names,
        matrix([p for _, p in told]),
        matrix([r.prior for r, _ in told]),
        np.array([column[r.suspect_truth] for r, _ in told]),
        tuple(r.layout for r, _ in told),
    )


def sure_errors(seen: Forecasts) -> tuple[int, int, float]:
    """Errors among posteriors of 0.99 and more, how many these are, one-sided upper bound."""
    sure = seen.confidence >= SURE
    errors = int((sure & ~seen.right).sum())
    return errors, int(sure.sum()), upper_bound(errors, int(sure.sum()))


def constant_guesses(rows: Sequence[Row]) -> dict[str, Estimate]:
    """What answers without a look would score: the commonest motor fault, and the truth itself."""
    truths = Counter(r.truth for r in rows)
    motors = {name: n for name, n in truths.items() if name.startswith("motor_")}
    guesses = {"oracle": proportion(len(rows), len(rows))}
    if motors:
        best = max(motors, key=lambda name: motors[name])
        guesses[f"always {best}"] = proportion(motors[best], len(rows))
    return guesses


def _order(name: str) -> tuple[int, str]:
    """Faults by name, then what is no fault, then what is no answer."""
    last = (NONE, UNKNOWN, CANNOT_TELL, NO_ALARM)
    return (last.index(name) + 1 if name in last else 0, name)
