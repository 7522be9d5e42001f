"""Everything a report tells, read from a run's folder."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from base_station.recording.reading import Recording, Series
from hil.bench.folders import SCENARIO_FILE
from hil.bench.result import RESULT_FILE
from hil.bench.runlog import EVENTS_FILE, TRUTH_FILE
from hil.bench.viewers import recording_of
from hil.errors import InputError
from hil.scenario import Scenario, load_scenario
from hil.world.truth import ContactEpisode, TruthRecord, parse_line

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Curve:
    """One training: mean reward over steps."""

    kind: str
    name: str  # as 'attempt 1: ppo_mlp, accepted'
    steps: Array
    rewards: Array

    @property
    def accepted(self) -> bool:
        return "accepted" in self.name


@dataclass(frozen=True, eq=False)
class RunTold:
    """A run as its files tell it. `truth_m` [T, V, 2] at `truth_s`, in fleet order."""

    scenario: Scenario
    result: dict[str, Any]
    events: tuple[dict[str, Any], ...]
    truth_s: Array
    truth_m: Array
    reported_m: Array
    contacts: tuple[ContactEpisode, ...]
    residuals: dict[str, Series]  # by axis
    alarms: dict[str, Series]
    threshold: float
    posterior: Series
    curves: tuple[Curve, ...]

    @property
    def end_s(self) -> float:
        return float(self.truth_s[-1])

    def of(self, kind: str) -> list[dict[str, Any]]:
        """The events of a kind."""
        return [e for e in self.events if e["kind"] == kind]

    def phases(self) -> list[tuple[str, float, float]]:
        """Each phase with its beginning and its end (s)."""
        starts = [(e["text"], float(e["time_s"])) for e in self.of("phase")]
        ends = [*(begin for _, begin in starts[1:]), self.end_s]
        return [(name, begin, end) for (name, begin), end in zip(starts, ends, strict=True)]


def read_run(folder: Path) -> RunTold:
    """Raises InputError when the folder does not hold a run that got somewhere."""
    for name in (RESULT_FILE, EVENTS_FILE, TRUTH_FILE, SCENARIO_FILE):
        if not (folder / name).is_file():
            raise InputError(f"{folder}: no {name} there; name the folder of a run")
    scenario = load_scenario(folder / SCENARIO_FILE, [])
    truth, contacts = _truth(folder / TRUTH_FILE)
    if not truth:
        raise InputError(f"{folder / TRUTH_FILE}: empty; the run did not get that far")
    recording = Recording(recording_of(folder))
    sysids = [v.sysid for v in scenario.fleet]
    places = [[(r.vehicles[s].north_m, r.vehicles[s].east_m) for s in sysids] for r in truth]
    threshold = recording.scalars("/alarm/threshold").values
    events = (folder / EVENTS_FILE).read_text(encoding="utf-8").splitlines()
    return RunTold(
        scenario=scenario,
        result=json.loads((folder / RESULT_FILE).read_text(encoding="utf-8")),
        events=tuple(json.loads(line) for line in events),
        truth_s=np.array([r.time_s for r in truth]),
        truth_m=np.array(places),
        reported_m=recording.places("/fleet")[1],
        contacts=tuple(contacts),
        residuals={axis: recording.scalars(f"/residual/{axis}") for axis in ("north", "east")},
        alarms={axis: recording.scalars(f"/alarm/{axis}") for axis in ("north", "east")},
        threshold=float(threshold[0, 0]) if threshold.size else float("nan"),
        posterior=recording.family("/belief/posterior"),
        curves=_curves(recording),
    )


def _truth(path: Path) -> tuple[list[TruthRecord], list[ContactEpisode]]:
    records, contacts = [], []
    with path.open(encoding="utf-8") as lines:
        for told in map(parse_line, lines):
            if isinstance(told, TruthRecord):
                records.append(told)
            elif told is not None:
                contacts.append(told)
    return records, contacts


def _curves(recording: Recording) -> tuple[Curve, ...]:
    curves = []
    for entity in recording.entities("/learning/"):
        series = recording.scalars(entity, "training_steps")
        if series.times.size:
            name = series.names[0] if series.names else "attempt"
            kind = entity.split("/")[2]
            curves.append(Curve(kind, name, series.times, series.values[:, 0]))
    return tuple(curves)
