"""What twins hear of the orders sent over a link that delays and loses."""

from dataclasses import replace

import numpy as np
import pytest

from base_station.belief import hearing
from base_station.belief.hearing import Hearing
from base_station.execution import Orders
from base_station.receiving.telemetry import Frame, Sample, Track

DRAWS, VEHICLES, PERIOD_S = 400, 2, 0.1


def frame(time_s: float, loss: float = 0.0, delay_s: float = 0.0, driven: bool = True) -> Frame:
    zeros, two = np.zeros((VEHICLES, 2)), np.ones(VEHICLES)
    yes = two.astype(np.bool_)
    return Frame(time_s, zeros, zeros, 0 * two, yes, loss * two, delay_s * two, driven & yes)


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


@pytest.mark.parametrize(("delay_s", "ticks"), [(0.05, 0), (0.1, 1), (0.25, 2), (9.0, 3)])
def test_orders_come_as_late_as_the_link(delay_s: float, ticks: int) -> None:
    sent = [0.1, 0.2, 0.3, 0.4]
    assert (after(sent, delay_s=delay_s).setpoints == sent[-1 - ticks]).all()


def test_as_many_set_points_get_lost_as_reports_do_but_none_of_the_first_draw() -> None:
    heard = after([0.5, 0.7], loss=0.2)
    assert (heard.setpoints[0] == 0.7).all()
    kept = (heard.setpoints[1:] == 0.7).mean()
    sigma = np.sqrt(0.2 * 0.8 / ((DRAWS - 1) * VEHICLES))
    assert kept == pytest.approx(0.8, abs=4 * sigma)


def test_the_same_tick_is_heard_alike_again() -> None:
    one, other = after([0.5, 0.7], loss=0.3), after([0.5, 0.7], loss=0.3)
    np.testing.assert_array_equal(one.setpoints, other.setpoints)


def test_half_of_the_draws_change_mode_when_it_was_due_half_when_it_is_confirmed() -> None:
    heard = hearing.nothing_yet(DRAWS, VEHICLES)
    heard = hearing.heard(heard, orders(0.5), frame(0.0, driven=False), PERIOD_S)
    assert heard.driven[::2].all()
    assert not heard.driven[1::2].any()


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
