"""What twins hear of the orders sent over a link that delays and loses."""

from dataclasses import replace

import numpy as np
import pytest

from base_station.belief import hearing
from base_station.belief.hearing import Hearing
from base_station.execution import Orders
from base_station.receiving.telemetry import Frame, Sample, Track

DRAWS, VEHICLES, PERIOD_S = 400, 2, 0.1


def frame(
    time_s: float,
    loss: float = 0.0,
    delay_s: float = 0.0,
    jitter_s: float = 0.0,
    driven: bool = True,
    came: bool = True,
) -> Frame:
    zeros, two = np.zeros((VEHICLES, 2)), np.ones(VEHICLES)
    yes = two.astype(np.bool_)
    link = loss * two, delay_s * two, jitter_s * two
    return Frame(time_s, zeros, zeros, 0 * two, yes, came & yes, *link, driven & yes)


def orders(speed_mps: float) -> Orders:
    setpoints = np.full((VEHICLES, 3), speed_mps)
    return Orders(setpoints, np.full(VEHICLES, speed_mps > 0.0))


def after(speeds_mps: list[float], **link: float) -> Hearing:
    heard = hearing.nothing_yet(DRAWS, VEHICLES)
    for k, speed_mps in enumerate(speeds_mps):
        heard = hearing.heard(heard, orders(speed_mps), frame(0.1 * k, **link), PERIOD_S)
    return heard


def test_on_a_sound_link_everybody_hears_at_once() -> None:
    heard = after([0.5, 0.7])
    assert (heard.setpoints == 0.7).all()
    assert heard.driven.all()


@pytest.mark.parametrize("delay_s", [0.04, 0.1, 0.2, 0.25])
def test_orders_come_as_late_as_the_link(delay_s: float) -> None:
    """In the middle of a tick, too: the mean of what is obeyed before and after."""
    heard = after([0.0, 1.0, 2.0, 3.0], delay_s=delay_s).setpoints[:, :, :2]
    np.testing.assert_allclose(3.0 - heard, delay_s / PERIOD_S)


def test_who_is_to_stand_drives_until_that_has_come() -> None:
    heard = after([0.5, 0.0], delay_s=0.04, driven=False)
    np.testing.assert_allclose(heard.setpoints, 0.4 * 0.5)
    assert heard.driven.all()


def test_orders_later_than_is_remembered_are_those_before_all() -> None:
    assert (after([0.1, 0.2, 0.3, 0.4], delay_s=9.0).setpoints == 0.1).all()


def test_every_draw_has_a_round_trip_of_its_own_within_what_was_seen() -> None:
    late = 9.0 - after(list(np.arange(10.0)), delay_s=0.45, jitter_s=0.1).setpoints[1:, :, 0]
    assert late.mean() == pytest.approx(4.5, abs=0.15)
    assert late.std() == pytest.approx(1.0, rel=0.1)


def test_as_many_set_points_get_lost_as_reports_do_but_none_of_the_first_draw() -> None:
    heard = after([0.5, 0.7], loss=0.2)
    assert (heard.setpoints[0] == 0.7).all()
    alone = heard.setpoints[2::2]
    sigma = np.sqrt(0.2 * 0.8 / alone[..., 0].size)
    assert (alone == 0.7).mean() == pytest.approx(0.8, abs=4 * sigma)


def test_half_of_the_draws_hear_nothing_while_nothing_is_heard() -> None:
    heard = hearing.heard(after([0.5]), orders(0.0), frame(0.1, came=False), PERIOD_S)
    assert (heard.setpoints[1::2] == 0.5).all()
    assert (heard.setpoints[::2] == 0.0).all()


def test_the_same_tick_is_heard_alike_again() -> None:
    one, other = after([0.5, 0.7], loss=0.3), after([0.5, 0.7], loss=0.3)
    np.testing.assert_array_equal(one.setpoints, other.setpoints)


def test_half_of_the_draws_change_mode_when_it_was_due_half_when_it_is_confirmed() -> None:
    heard = hearing.nothing_yet(DRAWS, VEHICLES)
    heard = hearing.heard(heard, orders(0.5), frame(0.0, driven=False), PERIOD_S)
    assert heard.driven.reshape(-1, 4, VEHICLES)[:, :2].all()
    assert not heard.driven.reshape(-1, 4, VEHICLES)[:, 2:].any()


def test_rows_take_turns_by_draw() -> None:
    heard = replace(after([0.5]), setpoints=np.arange(6.0).reshape(2, 1, 3), driven=np.ones((2, 1)))
    setpoints, driven = heard.of_rows(4)
    assert setpoints[:, 0, 0].tolist() == [0.0, 0.0, 3.0, 3.0]
    assert driven.shape == (4, 1)


def test_a_mode_counts_from_the_report_that_it_came_with() -> None:
    track = Track()
    for k in range(5):
        track.position(Sample(0.1 * k, (0.0, 0.0), (0.0, 0.0)))
        track.said(replace(track.status, mode=15 if k >= 3 else 4))
    assert [track.mode_at(t) for t in (0.1, 0.2, 0.3, 0.4)] == [4, 4, 15, 15]


def test_loss_is_the_share_of_missing_reports() -> None:
    track = Track()
    for k in range(61):
        if k % 5:
            track.position(Sample(0.1 * k, (0.0, 0.0), (0.0, 0.0)))
    assert track.loss(6.0, 0.1) == pytest.approx(0.2, abs=0.03)
