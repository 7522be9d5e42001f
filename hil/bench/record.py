"""What a run left behind, for the score and the result (pure)."""

from dataclasses import dataclass

from hil.bench.lines import Outcome
from hil.scenario import FaultModel, Scenario
from hil.world.truth import ContactEpisode, TruthRecord


@dataclass(frozen=True)
class Struck:
    """A fault that is in effect since `time_s` of world time."""

    fault: FaultModel
    time_s: float


@dataclass(frozen=True)
class RunRecord:
    """What a run left behind; `outcome` is None when the station never concluded."""

    outcome: Outcome | None
    truth: TruthRecord | None
    contacts: tuple[ContactEpisode, ...]
    struck: tuple[Struck, ...]


def describe_fault(scenario: Scenario, fault: FaultModel) -> str:
    """As in 'rover_2: motor 3, 4 off', 'rover_1: gps all offset 3, -2, 0'."""
    what = fault.fault()
    parts = (", ".join(map(str, what.instances)), ", ".join(what.axes))
    part = parts[0] or parts[1] or "all"
    size = "".join((" ", ", ".join(f"{s:g}" for s in what.size)) if what.size else ())
    return f"{scenario.vehicle(fault.vehicle).name}: {fault.unit} {part} {fault.type}{size}"
