"""What a run came to, as the station believes it: collected on the way, told once at the end."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from base_station.desk import Desk
from base_station.mission import DRIFT_FRACTION
from base_station.planning.requests import PlanReady
from hil.faults import Unit

UNCERTAIN_SIGMA_M = 0.05  # two of these are all that 0.3 m of true distance leaves over 0.2 m


@dataclass
class PhaseTimes:
    """Wall and simulation time spent in each phase, in order of first entry."""

    spent: dict[str, list[float]] = field(default_factory=dict)
    _last: tuple[str, float, float] | None = None

    def at(self, phase: str, wall_s: float, sim_s: float) -> None:
        if self._last is not None:
            name, wall, sim = self._last
            total = self.spent.setdefault(name, [0.0, 0.0])
            total[0] += wall_s - wall
            total[1] += sim_s - sim
        self._last = (phase, wall_s, sim_s)

    def told(self) -> list[dict[str, Any]]:
        return [
            {"phase": name, "wall_s": round(wall, 3), "sim_s": round(sim, 3)}
            for name, (wall, sim) in self.spent.items()
        ]


def training(answer: PlanReady) -> dict[str, Any]:
    """One line on the trainings behind a plan."""
    last = answer.trainings[-1]
    return {
        "kind": answer.kind,
        "planner": last.planner,
        "preset": last.preset,
        "timesteps": sum(t.timesteps for t in answer.trainings),
        "restarts": len(answer.trainings) - 1,
        "wall_s": round(sum(t.wall_s for t in answer.trainings), 3),
    }


def outcome(desk: Desk, phases: PhaseTimes, trainings: list[dict[str, Any]]) -> Mapping[str, Any]:
    """The station's own account, plain JSON values only."""
    verdict = desk.verdict
    return {
        "alarm": desk.alarm,
        "verdict": verdict
        and {
            "sysid": verdict.sysid,
            "hypothesis": verdict.hypothesis,
            "posterior": verdict.posterior,
            "decided": verdict.decided,
        },
        "ended": getattr(desk.phase, "reason", desk.phase.name),
        "goals": {str(m.sysid): _goal(desk, v) for v, m in enumerate(desk.view.fleet)},
        "phases": phases.told(),
        "trainings": trainings,
    }


def _goal(desk: Desk, v: int) -> dict[str, Any]:
    time_s = desk.goals.times_s[v]
    return {
        "declared": _declared(desk, v),
        "time_s": None if np.isnan(time_s) else round(time_s, 3),
    }


def _declared(desk: Desk, v: int) -> str:
    if not desk.watching or v in desk.goals.left or not desk.goals.there(desk.watch.state)[v]:
        return "unreached"
    return "uncertain" if _drift_sigma_m(desk, v) > UNCERTAIN_SIGMA_M else "reached"


def _drift_sigma_m(desk: Desk, v: int) -> float:
    """How far off a position may be that was reckoned without one of its GPS axes."""
    watch = desk.watch
    stuck = any(
        h.fault and h.fault.unit is Unit.GPS and watch.baseline.model.index(h.sysid) == v
        for h in watch.baseline.known
    )
    return DRIFT_FRACTION * watch.travelled_m[v] if stuck else 0.0
