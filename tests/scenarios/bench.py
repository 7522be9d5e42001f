"""A scenario in memory with whatever planner a test wants, faults injected as `hil run` does."""

from collections.abc import Callable, Iterator

import numpy as np

from base_station.listeners import Silent
from base_station.node import Keeper
from base_station.planning.requests import (
    OpenLoopPlan,
    PlanProgress,
    PlanReady,
    PlanRequest,
    Training,
)
from base_station.records import Event
from hil.bench.folders import blind_view
from hil.bench.injector import Breaker
from hil.bench.onsets import Onsets
from hil.bench.rig import Learn, Rig
from hil.scenario import Scenario, StationView

TRAINING = Training("scripted", "none", 0, True, 0, 0.0, ())


class Heard(Silent):
    """The station's events."""

    def __init__(self) -> None:
        self.events: list[Event] = []

    def event(self, event: Event) -> None:
        self.events.append(event)

    def texts(self, kind: str) -> list[str]:
        return [e.text for e in self.events if e.kind == kind]


def scripted(east_mps: float, seconds: float = 4.5) -> Learn:
    """Plan alpha: the first rover drives east, all others hold. There is no plan beta."""

    def learn(
        view: StationView, request: PlanRequest, _progress: Callable[[PlanProgress], None]
    ) -> PlanReady:
        if request.kind == "beta":
            return PlanReady(request.number, "beta", (TRAINING,))
        count = len(view.fleet)
        setpoints = np.zeros((round(seconds / 0.5), count, 3))
        setpoints[:, :, 2] = np.nan
        setpoints[:, 0, 1] = east_mps
        reports = np.zeros((len(request.hypotheses), len(setpoints) + 1, count, 2))
        plan = OpenLoopPlan(setpoints, 0.5, tuple(range(1, count)), 0.001, reports)
        return PlanReady(request.number, "alpha", (TRAINING,), plan)

    return learn


def start(
    scenario: Scenario,
    learn: Learn,
    journal: Keeper | None = None,
    key: bytes | None = None,
) -> tuple[Rig, Heard, Iterator[float]]:
    """A rig whose faults strike as the scenario says; iterate to let time pass (s)."""
    heard = Heard()
    rig = Rig(scenario, blind_view(scenario), [heard], learn, journal, key)
    breaker = Breaker(scenario, lambda _: None, lambda _: None, rig.simulation.obey, rig.signing)
    onsets = Onsets(scenario)
    breaker.strike(onsets.at_start())

    def inject() -> None:
        for vehicle, link in zip(scenario.fleet, rig.injector_links, strict=True):
            for datagram in breaker.step(rig.time_s, vehicle.sysid, link.receive()):
                link.send(datagram)

    def times() -> Iterator[float]:
        while not breaker.done:
            inject()
            rig.serve()
        for advance in rig.run():
            for record in advance.truth:
                breaker.strike(onsets.due(record))
                breaker.mend(onsets.over(record))
            inject()
            yield rig.time_s

    return rig, heard, times()


def run_until_ended(rig: Rig, times: Iterator[float], limit_s: float = 120.0) -> None:
    for time_s in times:
        if rig.node.finished:
            return
        assert time_s < limit_s, "the station did not conclude"
