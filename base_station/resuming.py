"""A station that died, from its journal: the same belief, goals and open plan as when it died."""

from dataclasses import dataclass
from pathlib import Path

from base_station.journal import Head, Inputs, Said, event_tree, read_journal
from base_station.node import StationNode
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest
from base_station.records import Event
from hil.errors import InputError
from hil.scenario import StationView


class _Nobody:
    """Stands for the planner while a journal is replayed."""

    def submit(self, request: PlanRequest) -> None: ...

    def poll(self) -> list[PlanProgress | PlanReady]:
        return []


@dataclass(frozen=True)
class Resumed:
    """The node as it was after its last step, with nothing attached, and the clocks of that step.

    `steps` were replayed. `differs` is the first event that came out otherwise than it had been
    told, as when the station's code has changed in between.
    """

    node: StationNode
    view: StationView
    wall_s: float
    epoch_us: int
    steps: int
    differs: str | None

    def wall_offset_s(self, monotonic_s: float, epoch_us: int) -> float:
        """To be added to a monotonic clock, so that the station's wall time goes on.

        Time that passed while it was dead has passed; a clock set back in between has not.
        """
        dead_s = max(0.0, (epoch_us - self.epoch_us) / 1e6)
        return self.wall_s + dead_s - monotonic_s


def head_of(folder: Path) -> Head:
    """How the journal begins. Raises InputError where there is none."""
    for record in read_journal(folder):
        if isinstance(record, Head):
            return record
    raise InputError(f"{folder}: its journal is empty; start the station anew")


def resume(folder: Path, key: bytes | None) -> Resumed:
    """Replay a folder's journal. Raises InputError where there is none, or one that needs a key."""
    head = head_of(folder)
    if head.signed and key is None:
        raise InputError(f"{folder}: its links were signed; give the same --signing-key")
    view = StationView.model_validate(head.view)
    node = StationNode(view, (), _Nobody(), (), key=key if head.signed else None)
    last = Inputs(0.0, 0)
    steps = 0
    due: list[Event] = []
    differs: str | None = None
    for record in read_journal(folder):
        match record:
            case Head(resumed=True) if steps:
                node.station.interrupted()
            case Inputs():
                due = list(node.replay(record))
                last = record
                steps += 1
            case Said(event=told) if differs is None:
                now = event_tree(due.pop(0)) if due else {}
                if now.get("kind") != told.get("kind") or now.get("text") != told.get("text"):
                    differs = str(told.get("text"))
            case _:
                pass
    node.station.interrupted()
    return Resumed(node, view, last.wall_s, last.epoch_us, steps, differs)
