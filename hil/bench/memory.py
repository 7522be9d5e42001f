"""A run in memory: the same code as over UDP, in one process, in lockstep, deterministic."""

from contextlib import ExitStack
from pathlib import Path

from base_station.journal import Head, Journal
from base_station.listeners import open_listeners
from hil.bench.folders import blind_view
from hil.bench.injector import Breaker
from hil.bench.onsets import Onsets
from hil.bench.rig import Rig
from hil.bench.runlog import RunLog
from hil.errors import ProcessDiedError
from hil.scenario import Scenario
from hil.world.simulation import Advance

GIVE_UP_S = 1800.0  # simulation time; every phase of the station ends long before


def run_in_memory(
    scenario: Scenario,
    folder: Path,
    run_id: str,
    viewer: str | None,
    log: RunLog,
    onsets: Onsets,
    key: bytes | None = None,
) -> None:
    """Until the station has concluded. Raises InputError for a refused fault, ProcessDiedError."""
    with ExitStack() as stack:
        view = blind_view(scenario)
        listeners = open_listeners(stack, folder, run_id, view, viewer, log.station)
        journal = Journal(folder, Head(view.model_dump(mode="json"), signed=key is not None))
        stack.callback(journal.close)
        rig = Rig(scenario, view, listeners, journal=journal, key=key)
        breaker = Breaker(
            scenario,
            lambda fault: log.struck(fault, rig.time_s),
            lambda fault: log.mended(fault, rig.time_s),
            rig.simulation.obey,
            rig.signing,
        )
        breaker.strike(onsets.at_start())
        while not breaker.done:
            _inject(rig, breaker, scenario)
            rig.serve()
        for advance in rig.run():
            _tell(advance, log, breaker, onsets)
            _inject(rig, breaker, scenario)
            if log.outcome is not None:
                break
            if rig.time_s > GIVE_UP_S:
                raise ProcessDiedError(f"the station did not conclude in {GIVE_UP_S:.0f} s")
        _tell(rig.simulation.close(), log, breaker, onsets)


def _tell(advance: Advance, log: RunLog, breaker: Breaker, onsets: Onsets) -> None:
    for record in advance.truth:
        log.truth(record)
        breaker.strike(onsets.due(record))
        breaker.mend(onsets.over(record))
    for episode in advance.contacts:
        log.contact(episode)


def _inject(rig: Rig, breaker: Breaker, scenario: Scenario) -> None:
    for vehicle, link in zip(scenario.fleet, rig.injector_links, strict=True):
        for datagram in breaker.step(rig.time_s, vehicle.sysid, link.receive()):
            link.send(datagram)
