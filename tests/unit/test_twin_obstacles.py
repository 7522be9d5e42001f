"""Obstacles of a scenario: in the twin as in the pymunk world, and as closed forms have them.

Yaw locked and data-sheet parameters in both.
"""

import math

import pytest
from side_by_side import Tracks, scene, side_by_side

from hil.airframe import OMNI_PLUS
from hil.scenario import Obstacle, Point

HOLD = None
DISC = Obstacle(at=Point(north_m=0.0, east_m=2.0), radius_m=0.4)
RIM_M = 2.0  # the south side of:
ALONG = Obstacle(
    at=Point(north_m=RIM_M + 0.2, east_m=-2.0),
    to=Point(north_m=RIM_M + 0.2, east_m=4.0),
    radius_m=0.2,
)


def among(obstacle: Obstacle, starts_m, stretches) -> Tracks:
    scenario = scene(starts_m).model_copy(update={"obstacles": (obstacle,)})
    return side_by_side(scenario, stretches)


def test_a_disc_stops_a_rover_alike():
    tracks = among(DISC, [(0.0, 0.0)], [(4.0, [(0.0, 1.0)])])
    stop_m = 2.0 - 0.4 - OMNI_PLUS.radius_m
    assert tracks.twin[-1, 0, 1] == pytest.approx(stop_m, abs=1e-3)
    assert tracks.world[-1, 0, 1] == pytest.approx(stop_m, abs=2e-3)
    assert tracks.apart_m <= 0.03


@pytest.mark.parametrize("across_m", [0.4, 0.6])
def test_a_rover_slides_round_a_disc_alike(across_m):
    tracks = among(DISC, [(across_m, 0.0)], [(5.0, [(0.0, 1.0)])])
    assert tracks.world[-1, 0, 1] > 2.0  # it is past the disc
    assert tracks.apart_m <= 0.03


def test_a_push_into_a_disc_ends_alike():
    tracks = among(DISC, [(0.0, -0.5), (0.0, 0.5)], [(4.0, [(0.0, 1.0), HOLD])])
    assert tracks.moved_m[1] == pytest.approx(2.0 - 0.4 - OMNI_PLUS.radius_m - 0.5, abs=0.01)
    assert tracks.apart_m <= 0.03


def test_a_push_along_a_wall_agrees():
    """Off centre, so that the pushed rover is pressed to the wall and slides."""
    flush_m = RIM_M - OMNI_PLUS.radius_m
    starts_m = [(flush_m - 0.2, -1.0), (flush_m - 0.02, 0.0)]
    tracks = among(ALONG, starts_m, [(3.0, [(0.0, 1.0), HOLD]), (1.0, [HOLD, HOLD])])
    assert tracks.moved_m[1] > 0.5
    assert tracks.world[:, 1, 0].max() == pytest.approx(flush_m, abs=2e-3)
    assert tracks.apart_m <= 0.03


def test_the_distance_of_a_point_is_from_the_rim():
    assert DISC.distance_m(Point(north_m=3.0, east_m=6.0)) == pytest.approx(5.0 - 0.4)
    assert ALONG.distance_m(Point(north_m=RIM_M - 0.8, east_m=1.0)) == pytest.approx(0.8)
    beyond_m = ALONG.distance_m(Point(north_m=RIM_M + 1.2, east_m=5.0))
    assert beyond_m == pytest.approx(math.sqrt(2.0) - 0.2)
