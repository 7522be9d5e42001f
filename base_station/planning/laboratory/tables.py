"""Results as Markdown tables (pure)."""

import statistics
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from base_station.planning.laboratory.jobs import SIZES, Job

Row = dict[str, Any]
Z = 1.96  # 95 %
TARGET = 0.01
CONTEXT = (
    "The paper has 94 % (MLP) and 78 % (LSTM) of 50 trainings by one sampled trajectory each, at a "
    "threshold that it does not give, and about 3 hours for both plans: context, not the same "
    "measurement.\n"
)
THRESHOLDS_M = (0.1, 0.2, 0.3, 0.5, 1.0, 2.0)


def wilson(successes: int, count: int) -> tuple[float, float]:
    """The 95 % score interval of a share. Raises ValueError for a count of 0."""
    if count < 1:
        raise ValueError("a share of nothing has no interval")
    share, z2 = successes / count, Z * Z / count
    middle = (share + z2 / 2) / (1 + z2)
    half = Z * ((share * (1 - share) / count + z2 / count / 4) ** 0.5) / (1 + z2)
    return max(0.0, middle - half), min(1.0, middle + half)


def counted(flags: Sequence[bool]) -> str:
    """`48 of 50 (87-99 %)`"""
    low, high = wilson(sum(flags), len(flags))
    return f"{sum(flags)} of {len(flags)} ({100 * low:.0f}-{100 * high:.0f} %)"


def groups(rows: Mapping[str, Row], study: str) -> dict[tuple[str, ...], list[Row]]:
    """Rows of a study by case, planner, preset and change, in the order in which they came."""
    found: dict[tuple[str, ...], list[Row]] = {}
    for key, row in rows.items():
        name, case, planner, preset, _, change = key.split("/")
        if name == study:
            found.setdefault((case, planner, preset, change), []).append(row)
    return found


def report(rows: Mapping[str, Row]) -> str:
    """All tables that there are results for."""
    parts = (
        _paper,
        _together,
        _layouts,
        _thresholds,
        _by_vehicle,
        _objective,
        _ladder,
        _ablation,
        _cost,
    )
    return "\n".join(text for part in parts if (text := part(rows)))


def table(title: str, head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Markdown; nothing when there are no lines."""
    body = ["| " + " | ".join(line) + " |" for line in lines]
    if not body:
        return ""
    rule = "|" + "---|" * len(head)
    return "\n".join([f"## {title}", "", "| " + " | ".join(head) + " |", rule, *body, ""])


def _paper(rows: Mapping[str, Row]) -> str:
    lines = []
    for (case, planner, preset, _), found in groups(rows, "paper").items():
        first = [row["attempts"][0] for row in found]
        lasts = [row["attempts"][-1] for row in found]
        took = [attempt["cpu_s"] for attempt in first]
        played = [
            counted([attempt[how]["error"] <= TARGET for attempt in first])
            if case != "beta"
            else "-"
            for how in ("sample", "mode")
        ]
        lines.append(
            [
                f"{case}, {planner}, {preset}",
                counted([attempt["accepted"] for attempt in first]),
                counted([attempt["accepted"] for attempt in lasts]),
                *played,
                f"{statistics.median(took):.1f} ({max(took):.1f})",
                f"{statistics.median([attempt['timesteps'] for attempt in first]):,.0f}",
            ]
        )
    head = ["case, planner, preset", "without restarts", "with", "one sampled trajectory", "mode"]
    text = table("Trainings", [*head, "CPU s, median (largest)", "steps, median"], lines)
    return text and text + CONTEXT


def _together(rows: Mapping[str, Row]) -> str:
    """An experiment and a mission with the same number, all their attempts: one processor."""
    lines = []
    for case in ("near", "far"):
        parts = [_costs(rows, Job("paper", c, "ppo", "tuned", 0)) for c in (case, "beta")]
        both = [parts[0][n] + parts[1][n] for n in parts[0].keys() & parts[1].keys()]
        if both:
            spent = f"{statistics.median(both):.1f} ({max(both):.1f})"
            lines.append([f"{case} + beta, ppo, tuned", str(len(both)), spent])
    head = ["both plans, restarts included", "pairs", "CPU s, median (largest)"]
    return table("Both learned together", head, lines)


def _costs(rows: Mapping[str, Row], like: Job) -> dict[str, float]:
    """CPU time (s) of all attempts by the number of the job."""
    spent = {}
    for key, row in rows.items():
        study, case, planner, preset, number, change = key.split("/")
        if (study, case, planner, preset, change) == (
            like.study,
            like.case,
            like.planner,
            like.preset,
            like.change,
        ):
            spent[number] = sum(attempt["cpu_s"] for attempt in row["attempts"])
    return spent


def _layouts(rows: Mapping[str, Row]) -> str:
    found = groups(rows, "layouts")
    lines = [_of_layouts(tier, some) for (tier, *_), some in found.items()]
    if len(found) > 1:
        lines.append(_of_layouts("all", [row for some in found.values() for row in some]))
    head = ["tier", "feasible", "without restarts", "with", "CPU s, median (largest)"]
    return table("Missions on random layouts of the test set", head, lines)


def _of_layouts(tier: str, some: Sequence[Row]) -> list[str]:
    tried = [row["attempts"] for row in some if row["attempts"]]
    if not tried:
        return [tier, f"0 of {len(some)}", "-", "-", "-"]
    took = [attempts[0]["cpu_s"] for attempts in tried]
    return [
        tier,
        f"{len(tried)} of {len(some)}",
        counted([attempts[0]["accepted"] for attempts in tried]),
        counted([attempts[-1]["accepted"] for attempts in tried]),
        f"{statistics.median(took):.1f} ({max(took):.1f})",
    ]


def _thresholds(rows: Mapping[str, Row]) -> str:
    lines = []
    for (case, planner, preset, _), found in groups(rows, "paper").items():
        if case == "beta":
            continue
        samples = [row["attempts"][0]["sample"]["d_m"] for row in found]
        shares = [f"{sum(d > limit for d in samples)} of {len(samples)}" for limit in THRESHOLDS_M]
        lines.append([f"{case}, {planner}, {preset}", *shares])
    head = ["D at the end of a sampled trajectory", *(f"> {limit} m" for limit in THRESHOLDS_M)]
    return table("Success against threshold", head, lines)


def _by_vehicle(rows: Mapping[str, Row]) -> str:
    """Where D is: in the suspect, or in what touches differently because of it."""
    lines = []
    for (case, planner, preset, _), found in groups(rows, "paper").items():
        if case == "beta":
            continue
        middle = np.median([row["attempts"][0]["mode"]["by_vehicle_m"] for row in found], axis=0)
        lines.append([f"{case}, {planner}, {preset}", *(f"{d:.2f}" for d in middle)])
    head = ["D by vehicle at the end of the mode, median, m", "1", "2 (suspect)", "3"]
    return table("D by vehicle", head, lines)


def _objective(rows: Mapping[str, Row]) -> str:
    found = groups(rows, "objective")
    lines = []
    for (case, planner, _, objective), some in found.items():
        best = statistics.median(row["best"] for row in some)
        cem = found.get((case, "cem", "tuned", objective))
        share = best / statistics.median(row["best"] for row in cem) if cem else float("nan")
        lines.append([case, objective, planner, f"{best:.2f}", f"{share:.2f}", str(len(some))])
    head = ["case", "objective", "planner", "best plan, median", "of cem's", "trainings"]
    return table("What the best plan earns, all at 40,000 steps", head, lines)


def _ladder(rows: Mapping[str, Row]) -> str:
    def middle(some: list[Row], name: str) -> str:
        values = [row[name] for row in some if row.get(name) is not None]
        return f"{statistics.median(values):.2f}" if values else "-"

    lines = [
        [
            tier,
            planner,
            counted([row["accepted"] for row in some]),
            middle(some, "information_low_bits"),
            middle(some, "impulse_ns"),
            middle(some, "cpu_s"),
            f"{statistics.median([row.get('timesteps', 0) for row in some]):,.0f}",
        ]
        for (tier, planner, _, _), some in groups(rows, "ladder").items()
    ]
    head = ["tier", "planner", "success", "bit, worst tenth", "impulse, N s", "CPU s", "steps"]
    return table("The ladder of planners, on random layouts of the test set", head, lines)


def _ablation(rows: Mapping[str, Row]) -> str:
    lines = [
        [
            case,
            change,
            counted([row["attempts"][0]["accepted"] for row in some]),
            f"{statistics.median([row['attempts'][0]['timesteps'] for row in some]):,.0f}",
        ]
        for (case, _, _, change), some in groups(rows, "ablation").items()
    ]
    return table("Ablations", ["case", "change", "without restarts", "steps, median"], lines)


def _cost(rows: Mapping[str, Row]) -> str:
    timed = [rows[key] for n in SIZES if (key := Job("cost", "twin", "-", "-", n).key) in rows]
    lines = [[str(row["vehicles"]), f"{row['ns_per_step'] / 1000:.2f}"] for row in timed]
    text = table("Cost of a fleet step", ["vehicles", "us"], lines)
    if len(timed) > 1:
        n, ns = (np.log([row[key] for row in timed]) for key in ("vehicles", "ns_per_step"))
        text += f"Exponent in the number of vehicles: {np.polyfit(n, ns, 1)[0]:.2f}.\n"
    return text
