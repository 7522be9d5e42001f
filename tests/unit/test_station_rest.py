"""When a fleet that was told to stand does stand, as far as its reports tell."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from base_station import twin
from base_station.belief.watch import Baseline, Moment, Watch
from base_station.desk import LONG_REST_S, Desk
from base_station.execution import REST_S, hold
from base_station.receiving.telemetry import Frame
from hil.scenario import StationView

PERIOD_S = 0.1
STOPS_S = 2.1


def desk_after(view: StationView, seconds: float, north_m: Callable[[float], float]) -> Desk:
    """In HOLD since 0; vehicle 1 reports `north_m` of the time."""
    model = twin.FleetModel.from_view(view)
    state = twin.initial_state(np.zeros((3, 2)), np.zeros(3))
    desk = Desk(view)
    desk.watch = Watch(view, Baseline(model), state, 0.0)
    zero, yes = np.zeros(3), np.ones(3, dtype=np.bool_)
    for k in range(round(seconds / PERIOD_S) + 1):
        at_m: NDArray[np.float64] = np.zeros((3, 2))
        at_m[1, 0] = north_m(k * PERIOD_S)
        frame = Frame(k * PERIOD_S, at_m, np.zeros((3, 2)), zero, yes, yes, zero, zero, zero, ~yes)
        desk.watch.memory.append(Moment(frame, hold(3), state[None]))
    return desk


def rolling_out(time_s: float) -> float:
    """From 1 m/s, evenly slower until STOPS_S."""
    left_s = max(0.0, STOPS_S - time_s)
    return 0.5 * STOPS_S - 0.5 * left_s**2 / STOPS_S


def test_who_stands_is_at_rest_after_a_while(rescue_view: StationView) -> None:
    assert not desk_after(rescue_view, REST_S - PERIOD_S, lambda _: 1.0).at_rest(0.0)
    assert desk_after(rescue_view, REST_S, lambda _: 1.0).at_rest(0.0)


def test_who_still_rolls_is_not(rescue_view: StationView) -> None:
    """It was taken to be where it was half a second before, and doubted for it."""
    assert not desk_after(rescue_view, REST_S + PERIOD_S, rolling_out).at_rest(0.0)
    ends_s = np.arange(REST_S, LONG_REST_S, PERIOD_S)
    end_s = next(t for t in ends_s if desk_after(rescue_view, t, rolling_out).at_rest(0.0))
    assert end_s < LONG_REST_S - 0.5
    desk = desk_after(rescue_view, end_s, rolling_out)
    assert desk.mean_report_m()[1, 0] == pytest.approx(0.5 * STOPS_S, abs=0.02)


def test_reports_that_wander_are_not_waited_for_for_ever(rescue_view: StationView) -> None:
    assert not desk_after(rescue_view, LONG_REST_S - PERIOD_S, lambda t: 0.3 * t).at_rest(0.0)
    assert desk_after(rescue_view, LONG_REST_S, lambda t: 0.3 * t).at_rest(0.0)
