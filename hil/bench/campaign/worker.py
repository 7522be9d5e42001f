"""One run of a campaign: the same function in this process, in joblib's and in Ray's."""

import time
from collections.abc import Callable
from dataclasses import replace

from base_station.belief.hypotheses import candidates
from base_station.planning.planner import plan
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest
from hil.bench.campaign.plan import RunSpec
from hil.bench.campaign.planners import planner
from hil.bench.campaign.row import Row
from hil.bench.campaign.witness import Witness
from hil.bench.folders import blind_view
from hil.bench.injector import Breaker
from hil.bench.labels import NONE, expected_hypothesis
from hil.bench.onsets import Onsets
from hil.bench.rig import Rig
from hil.scenario import FaultModel, Scenario, StationView
from hil.world.simulation import Advance
from hil.world.truth import ContactEpisode

Struck = list[tuple[FaultModel, float]]  # since when (s); one that ended has struck, too


def run_one(spec: RunSpec) -> Row:
    """Run it to its end. Never raises: what goes wrong is told in the row's `error`."""
    began_wall_s, began_cpu_s = time.monotonic(), time.process_time()
    row = Row(
        key=spec.key,
        point=spec.point,
        layout=spec.layout,
        repeat=spec.repeat,
        seed=int(spec.tree["seed"]),
        meant="",
    )
    try:
        row = _Run(spec, row).row()
    except Exception as error:  # one broken run must not end thousands of others
        row = replace(row, error=f"{type(error).__name__}: {error}"[:500])
    return replace(
        row,
        wall_s=round(time.monotonic() - began_wall_s, 4),
        cpu_s=round(time.process_time() - began_cpu_s, 4),
    )


class _Run:
    """A rig, whoever breaks it, and whoever watches."""

    def __init__(self, spec: RunSpec, row: Row) -> None:
        self._spec, self._row = spec, row
        self._scenario = spec.scenario()
        self._view = blind_view(self._scenario)
        self._planning_cpu_s = 0.0
        self._witness = Witness(lambda: self._rig.time_s, spec.how.look_after_s)
        learn = planner(spec.how, spec.policy, self._is_over, self._learn)
        self._rig = Rig(self._scenario, self._view, [self._witness], learn)
        self._struck: Struck = []
        self._onsets = Onsets(self._scenario)
        self._pending = len(self._scenario.faults)
        self._breaker = Breaker(
            self._scenario, self._note_fault, lambda _: None, self._rig.simulation.obey
        )
        self._contacts: list[ContactEpisode] = []

    def row(self) -> Row:
        """Let time pass until the run is over."""
        self._breaker.strike(self._onsets.at_start())
        while not self._breaker.done:
            self._inject()
            self._rig.serve()
        for advance in self._rig.run():
            self._take(advance)
            self._inject()
            if self._is_over():
                break
        self._take(self._rig.simulation.close())
        return self._told()

    def _is_over(self) -> bool:
        """A verdict from before the last fault does not count as one on it."""
        judged = bool(self._witness.verdicts) and len(self._struck) == self._pending
        stop_now = self._spec.how.stop == "verdict" and judged
        late = self._rig.time_s >= self._spec.how.limit_s
        return stop_now or late or self._rig.node.finished

    def _take(self, advance: Advance) -> None:
        for record in advance.truth:
            self._breaker.strike(self._onsets.due(record))
            self._breaker.mend(self._onsets.over(record))
        self._contacts += advance.contacts

    def _inject(self) -> None:
        for vehicle, link in zip(self._scenario.fleet, self._rig.injector_links, strict=True):
            for datagram in self._breaker.step(self._rig.time_s, vehicle.sysid, link.receive()):
                link.send(datagram)

    def _note_fault(self, fault: FaultModel) -> None:
        self._struck.append((fault, self._rig.time_s))

    def _learn(
        self, view: StationView, request: PlanRequest, progress: Callable[[PlanProgress], None]
    ) -> PlanReady:
        began_s = time.process_time()
        answer = plan(view, request, progress)
        self._planning_cpu_s += time.process_time() - began_s
        return answer

    def _told(self) -> Row:
        seen, end_s = self._witness, self._rig.time_s
        truths = true_names(self._scenario, self._struck)
        onsets = {f.vehicle: s for f, s in reversed(self._struck)}
        false = [a for a in seen.alarms if a.time_s < onsets.get(a.sysid, float("inf"))]
        right = [a.time_s for a in seen.alarms if a not in false]
        verdict = seen.verdicts[-1] if seen.verdicts else None
        suspect = verdict.sysid if verdict else next((a.sysid for a in seen.alarms), None)
        impulses = [c.peak_impulse_ns for c in self._contacts if not _with_wall(c)]
        walls = [c.peak_impulse_ns for c in self._contacts if _with_wall(c)]
        return replace(
            self._row,
            meant=_main(true_names(self._scenario, [(f, 0.0) for f in self._scenario.faults])),
            truth=_main(truths),
            suspect=suspect,
            suspect_truth=truths.get(suspect, NONE) if suspect is not None else NONE,
            hypothesis=verdict.hypothesis if verdict else None,
            decided=verdict.decided if verdict else False,
            posterior=verdict.posterior if verdict else seen.posterior,
            prior=self._prior(suspect),
            looks=seen.looks,
            onset_s=min(onsets.values(), default=None),
            alarm_s=right[0] if right else None,
            verdict_s=verdict.time_s if verdict else None,
            false_alarms=len(false),
            false_alarm_sysids=tuple(a.sysid for a in false),
            healthy_vehicle_s=round(
                sum(min(end_s, onsets.get(v.sysid, end_s)) for v in self._scenario.fleet), 4
            ),
            vehicle_s=round(end_s * len(self._scenario.fleet), 4),
            fleet_s=round(end_s, 4),
            ended=seen.ended,
            experiments=seen.experiments,
            contacts=len(impulses),
            contact_max_ns=round(max(impulses, default=0.0), 4),
            contact_sum_ns=round(sum(impulses), 4),
            wall_max_ns=round(max(walls, default=0.0), 4),
            planning_cpu_s=round(self._planning_cpu_s, 4),
        )

    def _prior(self, suspect: int | None) -> dict[str, float]:
        members = [m for m in self._view.fleet if m.sysid == suspect]
        priors = self._view.diagnosis.priors
        return {h.name: h.prior for m in members for h in candidates(m, priors)}


def true_names(scenario: Scenario, struck: Struck) -> dict[int, str]:
    """By system id, what the right verdict is called."""
    return {
        v.sysid: expected_hypothesis(faults, v.frame)
        for v in scenario.fleet
        if (faults := [f.fault() for f, _ in struck if f.vehicle == v.sysid])
    }


def _main(names: dict[int, str]) -> str:
    """Of the first vehicle that is broken."""
    return next(iter(names.values()), NONE)


def _with_wall(contact: ContactEpisode) -> bool:
    return any(body.startswith("wall_") for body in contact.bodies)
