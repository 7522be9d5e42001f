"""Each phase has its step: what it decides in a tick."""

from base_station.desk import Desk
from base_station.execution import Orders
from base_station.phases import (
    Concluding,
    Experimenting,
    OnMission,
    PlanningAlpha,
    PlanningBeta,
    Probing,
    Returning,
    Settling,
)
from base_station.receiving.telemetry import Frame
from base_station.steps.diagnosing import await_alpha, conclude, experiment, settle
from base_station.steps.probing import probe
from base_station.steps.travelling import await_beta, drive, go_home


def decide(desk: Desk, frame: Frame) -> Orders:
    """What the step that the phase belongs to decides."""
    if desk.alarmed and isinstance(desk.phase, PlanningBeta | OnMission | Returning):
        desk.suspect_the_worst()
    match desk.phase:
        case Probing() as phase:
            return probe(desk, phase, frame)
        case Settling() as phase:
            return settle(desk, phase, frame)
        case PlanningAlpha() as phase:
            return await_alpha(desk, phase)
        case Experimenting() as phase:
            return experiment(desk, phase, frame)
        case Concluding() as phase:
            return conclude(desk, phase, frame)
        case PlanningBeta(number=number):
            return await_beta(desk, number, frame)
        case OnMission() as phase:
            return drive(desk, phase, frame)
        case Returning() as phase:
            return go_home(desk, phase, frame)
        case _:
            return desk.hold()
