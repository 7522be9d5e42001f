"""`hil identify FLEET`: the links, the clock and the file around an `Identification`."""

import select
import time
from contextlib import ExitStack
from pathlib import Path

from base_station.field.budget import refuse_overload
from base_station.field.consent import ask_before_arming
from base_station.identify.session import Identification
from base_station.identify.store import write_fits
from base_station.node import StationNode
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest
from base_station.wiring import open_links
from hil.errors import InputError, ProcessDiedError
from hil.scenario import load_station_view

STEP_S = 0.05
READY_WITHIN_S = 180.0


class NoPlanner:
    """Identification plans nothing."""

    def submit(self, request: PlanRequest) -> None:
        raise AssertionError(request)

    def poll(self) -> list[PlanProgress | PlanReady]:
        return []


def identify(path: Path, out: Path | None) -> Path:
    """Drive each vehicle of a fleet, fit, and write beside the fleet file (or to `out`).

    Raises InputError, and ProcessDiedError when the fleet does not get ready or falls silent.
    """
    view = load_station_view(path)
    identification = Identification(view)
    print(f"{len(view.fleet)} vehicles, {identification.duration_s:.0f} s of driving to and fro")
    refuse_overload(view)
    with ExitStack() as stack:
        links = open_links(stack, view)
        ask_before_arming(view)
        node = StationNode(
            view, links, NoPlanner(), [identification], station=identification.station
        )
        deadline_s = time.monotonic() + READY_WITHIN_S
        while not node.finished:
            select.select([link.fileno() for link in links], [], [], STEP_S)
            now_s = time.monotonic()
            node.step(now_s, time.time_ns() // 1000)
            if not identification.station.desk.watching and now_s > deadline_s:
                raise ProcessDiedError(f"the fleet is not ready within {READY_WITHIN_S:.0f} s")
    if not identification.complete:
        raise ProcessDiedError("a vehicle was lost or taken over; nothing is written")
    target = out or path.with_suffix(".identified.yaml")
    try:
        write_fits(target, view, identification.fits())
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    return target
