"""The rule for vehicles that turn before they drive: where it brings all home, and where not."""

import numpy as np
import pytest
from planning_scenes import asked, planning

from base_station.planning.planner import plan
from base_station.planning.requests import Script, decode, encode
from hil.scenario import StationView


@pytest.fixture(params=["ardupilot", "testbed"])
def view(request: pytest.FixtureRequest, rescue_view: StationView) -> StationView:
    changes = {"airframe": "skid_steer", "autopilot": request.param}
    fleet = tuple(m.model_copy(update=changes) for m in rescue_view.fleet)
    goals = ((4.0, -3.0), (3.0, 0.0), (1.0, 3.5))
    fleet = tuple(
        m.model_copy(update={"goal": m.goal.model_copy(update={"north_m": n, "east_m": e})})
        for m, (n, e) in zip(fleet, goals, strict=True)
    )
    arena = rescue_view.arena.model_copy(
        update={"north_min_m": -6, "north_max_m": 10, "east_min_m": -7, "east_max_m": 7}
    )
    update = {"fleet": fleet, "yaw": "free", "arena": arena}
    changed = planning(rescue_view, mission="nose_first", beta_horizon_s=60.0, restarts=0)
    return changed.model_copy(update=update)


@pytest.mark.parametrize("fault", ["none", "motor_x_off"])
def test_it_brings_all_home(view: StationView, fault: str) -> None:
    """Nothing wrong, and a drive that is dead: the twin says so for 64 draws, before it is used."""
    found = plan(view, asked(view, "beta", fault), lambda _: None)
    assert found.policy == Script("nose_first")
    assert found.trainings[-1].curve[-1][1] >= 0.95
    again = decode(encode(found))
    assert again.policy == found.policy
    assert found.predicted_m is not None
    ways = np.array([[m.goal.north_m, m.goal.east_m] for m in view.fleet])
    assert np.linalg.norm(found.predicted_m[-1] - ways, axis=1).max() < 0.25


def test_off_its_rolling_axis_nobody_can_push_it_and_no_plan_is_given(view: StationView) -> None:
    goal = view.fleet[1].goal.model_copy(update={"north_m": 0.0, "east_m": 1.2})
    stuck = view.fleet[1].model_copy(update={"goal": goal})
    aside = view.model_copy(update={"fleet": (view.fleet[0], stuck, view.fleet[2])})
    assert plan(aside, asked(aside, "beta", "motor_x_off"), lambda _: None).policy is None
