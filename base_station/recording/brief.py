"""The page that says what run this is, how to read it and what came out (Markdown)."""

import platform
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version

from base_station.records import Event
from hil.scenario import StationView

PACKAGES = ("hil-fleet", "rerun-sdk", "numpy", "torch", "stable-baselines3", "pymavlink")
SHOWN_FROM = 5e-4  # explanations less likely than this are summed up in one row
KEPT = frozenset({"anomaly", "verdict", "goal", "takeover", "end"})

LEGEND = """\
| In the plane | Meaning |
|---|---|
| filled disc with a nose | where a vehicle **reports** to be, and its heading |
| white ring | where it **truly** is; the station never sees this (root `truth`) |
| coloured ring | where it would be **if that hypothesis were right**: its twin |
| coloured ellipse | what the station would then **receive**, two standard deviations wide |
| white arrow | where its orders would take it in 2 s |
| circle with a dot | goal, and how near counts as reached |
| dashed line | the geofence, if there is one: no plan leaves it |

One colour per vehicle and one per hypothesis, the same in all views. Dead motors are orange and
red, a stuck GPS is purple, blue and lavender, nothing wrong is grey. Weak or reversed motors and
other faults of a GPS are paler or darker.
"""


def ranked(posterior: Mapping[str, float]) -> list[tuple[str, float]]:
    """Explanations, the likeliest first; those that hardly count are one row, 'all others'."""
    falling = sorted(posterior.items(), key=lambda item: -item[1])
    shown = [(name, p) for name, p in falling if p >= SHOWN_FROM]
    rest = falling[len(shown) :]
    return [*shown, ("all others", sum(p for _, p in rest))] if rest else shown


class Brief:
    """Collects what matters of a run; `markdown` is the page as it stands."""

    def __init__(self, run_id: str, view: StationView) -> None:
        self._run_id, self._view = run_id, view
        self._names = {m.sysid: m.name for m in view.fleet}
        self._kept: list[Event] = []

    def hear(self, event: Event) -> bool:
        """Whether the page is worth writing again."""
        if event.kind in KEPT:
            self._kept.append(event)
        return event.kind in ("verdict", "end")

    def markdown(self) -> str:
        parts = (
            f"# Run {self._run_id}",
            self._verdict(),
            self._story(),
            "## How to read this",
            LEGEND,
        )
        return "\n\n".join(part for part in (*parts, self._setting()) if part)

    def _verdict(self) -> str:
        verdicts = [e for e in self._kept if e.kind == "verdict"]
        if not verdicts:
            return "*No verdict yet.*"
        event = verdicts[-1]
        posterior = event.data.get("posterior")
        rows = ""
        if isinstance(posterior, dict):
            rows = "\n\n| Hypothesis | Posterior |\n|---|---|\n" + "\n".join(
                f"| {name} | {p:.4f} |" for name, p in ranked(posterior)
            )
        return f"## Verdict\n\n**{event.text}**{rows}"

    def _story(self) -> str:
        if not self._kept:
            return ""
        lines = "\n".join(f"| {e.time_s:.1f} s | {e.kind} | {e.text} |" for e in self._kept)
        return f"## What happened\n\n| Time | What | |\n|---|---|---|\n{lines}"

    def _setting(self) -> str:
        view = self._view
        fleet = "\n".join(
            f"| {m.name} | {m.sysid} | {m.airframe} | {m.goal.north_m:g} | {m.goal.east_m:g} |"
            for m in view.fleet
        )
        told = view.model_dump_json(indent=1)
        return f"""\
## Fleet, as the station was told

| Name | System id | Airframe | Goal north (m) | Goal east (m) |
|---|---|---|---|---|
{fleet}

Heading {view.yaw}; evidence: {view.diagnosis.evidence}; decides at {view.diagnosis.decide_at:g};
preset {view.planning.preset}.

## Versions

{_versions()}

## Station view

```json
{told}
```"""


def _versions() -> str:
    found = [f"Python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)
