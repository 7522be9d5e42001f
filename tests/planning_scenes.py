"""Requests for plans in the rescue layout and further apart."""

import numpy as np

from base_station.belief.hypotheses import candidates, nominal
from base_station.planning.requests import PlanRequest
from base_station.twin import initial_state
from hil.scenario import Obstacle, StationView
from hil.scenario.places import Point

NEAR_M = 2.5


def asked(
    view: StationView, kind: str, *names: str, seed: int = 7, apart_m: float = NEAR_M
) -> PlanRequest:
    """Rovers 1 and 3 west and east of the suspect, rover 2."""
    known = {h.name: h for h in candidates(view.fleet[1], view.diagnosis.priors)}
    hypotheses = tuple(known[n] for n in names) or (nominal(1),)
    start = initial_state([[0.0, -apart_m], [0.0, 0.0], [0.0, apart_m]], [0.0] * 3)
    shares = (1.0 / len(hypotheses),) * len(hypotheses)
    states = np.stack([start] * len(hypotheses))
    return PlanRequest(1, kind, seed, "tuned", hypotheses, shares, states, (False,) * 3)


def experiment(view: StationView, **changes) -> PlanRequest:
    return asked(view, "alpha", "motor_y_off", "gps_east_stuck", **changes)


def planning(view: StationView, **changes) -> StationView:
    """The view with other keys in `planning`."""
    return view.model_copy(update={"planning": view.planning.model_copy(update=changes)})


def walled(view: StationView, *strokes: tuple[float, float, float, float, float]) -> StationView:
    """The view with obstacles: from and to (north, east), radius (m)."""
    obstacles = tuple(
        Obstacle(at=Point(north_m=a, east_m=b), to=Point(north_m=c, east_m=d), radius_m=radius)
        for a, b, c, d, radius in strokes
    )
    return view.model_copy(update={"obstacles": obstacles})
