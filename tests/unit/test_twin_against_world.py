"""The twin against the pymunk world: error bands, as docs/twin.md has them.

Yaw locked and data-sheet parameters in both unless a test says otherwise.
"""

import numpy as np
import pytest
from side_by_side import Tracks, in_twin, in_world, scene, side_by_side

from base_station.twin import FleetModel

EAST_1 = (0.0, 1.0)  # m/s
HOLD = None
STEP_M = 0.02  # how far 1 m/s goes in a step of the twin
DEFAULT_PLANT = {
    "motor_gain_sigma": 0.03,
    "mass_sigma": 0.02,
    "rolling_sigma": 0.1,
    "contact_friction": 0.2,
}


def pushed(across_m: float, speed_mps: float = 1.0, **how) -> Tracks:
    """Rover 1 drives east into rover 2, which is in HOLD; then both roll out."""
    scenario = scene([(across_m, -1.0), (0.0, 0.0)], **how)
    return side_by_side(scenario, [(3.0, [(0.0, speed_mps), HOLD]), (2.0, [HOLD, HOLD])])


@pytest.mark.parametrize("yaw", ["locked", "free"])
@pytest.mark.parametrize(
    "stretches",
    [
        [(3.0, [(0.3, -0.4)])],
        [(3.0, [(1.0, 0.0)])],
        [(2.0, [(1.0, 0.0)]), (2.0, [(-1.0, 0.0)])],
        [(2.0, [(0.8, 0.0)]), (2.0, [HOLD])],
    ],
)
def test_free_motion_agrees_within_three_centimetres(stretches, yaw):
    tracks = side_by_side(scene([(0.0, 0.0)], yaw), stretches)
    assert tracks.apart_m <= 0.03
    assert np.ptp(tracks.world, axis=0).max() > 0.5


def test_what_is_apart_in_free_motion_is_a_step_of_the_twin():
    """Its long explicit step runs ahead of the world's by about the step, and no further."""
    scenario = scene([(0.0, 0.0)])
    ends = [side_by_side(scenario, [(s, [(1.0, 0.0)])]) for s in (1.0, 2.0, 4.0, 8.0)]
    ahead = [t.twin[-1, 0, 0] - t.world[-1, 0, 0] for t in ends]
    assert all(0.0 < a <= 1.2 * STEP_M for a in ahead)
    assert ahead[3] < ahead[2] + 0.1 * STEP_M


@pytest.mark.parametrize("speed_mps", [0.5, 1.0])
@pytest.mark.parametrize("yaw", ["locked", "free"])
def test_a_head_on_push_agrees_within_three_centimetres(speed_mps, yaw):
    tracks = pushed(0.0, speed_mps, yaw=yaw)
    assert tracks.apart_m <= 0.03
    assert tracks.ends_apart_m.max() <= 0.012  # 4 mm at the world's step, see below
    assert tracks.moved_m[1] > 0.5


@pytest.mark.parametrize("across_m", [0.05, 0.15, 0.3, 0.45])
def test_an_off_centre_push_agrees_within_four_centimetres(across_m):
    tracks = pushed(across_m)
    assert tracks.apart_m <= 0.04
    assert tracks.moved_m[1] > 0.1


@pytest.mark.parametrize(("across_m", "band_m"), [(0.0, 0.03), (0.1, 0.06)])
def test_a_chain_of_three_agrees_within_six_centimetres(across_m, band_m):
    scenario = scene([(across_m, -1.0), (0.0, 0.0), (-across_m, 0.65)])
    push = [(3.0, [EAST_1, HOLD, HOLD]), (2.0, [HOLD, HOLD, HOLD])]
    tracks = side_by_side(scenario, push)
    assert tracks.apart_m <= band_m
    assert tracks.moved_m[2] > 0.5


def test_a_braked_rover_is_pushed_alike():
    scenario = scene([(0.0, -1.0), (0.0, 0.0)])
    tracks = side_by_side(scenario, [(3.0, [EAST_1, (0.0, 0.0)])])
    assert tracks.apart_m <= 0.03
    assert 0.3 < tracks.moved_m[1] < 1.2


def test_friction_that_is_not_known_moves_an_off_centre_push_by_decimetres():
    """Why friction is among the twin's uncertain parameters."""
    assert pushed(0.15, contact_friction=0.2).ends_apart_m[1] > 0.2


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("across_m", [0.0, 0.15])
def test_a_plant_off_its_data_sheet_stays_in_the_declared_ranges(across_m, seed):
    """The pushed rover's way is between those of the twin's draws, give or take a step."""
    scenario = scene([(across_m, -1.0), (0.0, 0.0)], **DEFAULT_PLANT)
    push = [(3.0, [EAST_1, HOLD]), (2.0, [HOLD, HOLD])]
    way = in_world(scenario, push, seed)[-1, 1]
    draws = in_twin(scenario, push, draws=64)[-1, :, 1]
    assert (draws.min(axis=0) - STEP_M <= way).all()
    assert (way <= draws.max(axis=0) + STEP_M).all()


@pytest.mark.parametrize("across_m", [0.05, 0.15])
def test_an_off_centre_push_of_a_free_yaw_agrees(across_m):
    assert pushed(across_m, yaw="free").apart_m <= 0.06


def test_what_is_apart_after_a_head_on_push_is_the_step_of_the_twin(monkeypatch):
    of_view = FleetModel.from_view.__func__

    def with_the_step_of_the_world(cls, view):
        model = of_view(cls, view)
        vehicles = model.vehicles._replace(dt_s=1.0 / view.clock.autopilot_hz / 4)
        return FleetModel(model.sysids, vehicles, model.nominal)

    scenario = scene([(0.0, -1.0), (0.0, 0.0)])
    push = [(3.0, [(0.0, 0.5), HOLD]), (2.0, [HOLD, HOLD])]
    coarse = side_by_side(scenario, push)
    monkeypatch.setattr(FleetModel, "from_view", classmethod(with_the_step_of_the_world))
    fine = in_twin(scenario, push)[::4]
    assert np.abs(fine[-1] - coarse.world[-1]).max() <= 0.005 < coarse.ends_apart_m.max()
