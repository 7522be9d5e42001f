"""A fix that stands while the estimate moves: what that says of each explanation."""

import math

import numpy as np
import pytest

from base_station.autopilots import adapter
from base_station.belief.fixes import UNHEARD_OF, Fixes
from base_station.belief.hypotheses import Hypothesis, candidates
from base_station.belief.particles import report_faults
from base_station.receiving.telemetry import Status
from hil.airframe import SKID_STEER
from hil.mavlink import EkfFlag
from hil.scenario import StationView

NOWHERE = np.array([math.nan, math.nan])


@pytest.fixture
def known(rescue_view: StationView) -> tuple[Hypothesis, ...]:
    return candidates(rescue_view.fleet[1], rescue_view.diagnosis.priors)


def said(fixes: Fixes, known: tuple[Hypothesis, ...]) -> dict[str, float]:
    return {h.name: x for h, x in zip(known, fixes.log_likelihood(known), strict=True)}


def gone(north_m: float, east_m: float, fix_m: float, lost: bool = False) -> Fixes:
    """An estimate that went so far, and a receiver that went a share of it, with 1 cm digits."""
    fixes = Fixes.none()
    for share in np.linspace(0.0, 1.0, 11):
        report = share * np.array([north_m, east_m])
        fixes = fixes.noted(report, np.round(fix_m * report, 2), lost)
    return fixes.noted(NOWHERE, NOWHERE, False)


def test_an_estimate_that_moves_over_a_fix_that_does_not_is_a_stuck_receiver(known) -> None:
    of = said(gone(0.5, 0.0, 0.0), known)
    assert of["gps_stuck"] == of["gps_north_stuck"] == 0.0
    for name in ("motor_x_off", "none", "gps_east_stuck", "gps_noise"):
        assert of[name] == UNHEARD_OF
    both = said(gone(0.5, -0.4, 0.0), known)
    assert both["gps_stuck"] == 0.0
    assert both["gps_north_stuck"] == UNHEARD_OF
    assert both["motor_x_off"] == 2.0 * UNHEARD_OF


def test_a_fix_that_goes_along_is_not_stuck(known) -> None:
    of = said(gone(0.5, 0.0, 0.9), known)
    assert of["gps_stuck"] == of["gps_north_stuck"] == UNHEARD_OF
    assert of["motor_x_off"] == of["none"] == of["gps_east_stuck"] == 0.0


@pytest.mark.parametrize("north_m", [0.0, 0.06])
def test_who_stands_says_nothing(known, north_m) -> None:
    assert set(said(gone(north_m, 0.0, 0.0), known).values()) == {0.0}


def test_without_a_fix_nothing_is_said(known) -> None:
    fixes = Fixes.none().noted(np.zeros(2), NOWHERE, True).noted(np.ones(2), NOWHERE, True)
    assert set(said(fixes, known).values()) == {0.0}


def test_an_estimator_that_is_lost_is_no_motors_fault(known) -> None:
    of = said(gone(0.0, 0.0, 0.0, lost=True), known)
    assert of["motor_x_off"] == of["none"] == UNHEARD_OF
    assert of["gps_drift"] == of["gps_stuck"] == 0.0
    located = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_HORIZ | EkfFlag.POS_HORIZ_ABS
    ardupilot = adapter("ardupilot", SKID_STEER)
    assert ardupilot.lost(Status(ekf_flags=int(EkfFlag.ATTITUDE)))
    assert not ardupilot.lost(Status(ekf_flags=int(located)))
    assert not ardupilot.lost(Status())
    assert not adapter("testbed", SKID_STEER).lost(Status(ekf_flags=1))


def test_reports_over_a_stuck_fix_may_bounce_where_the_estimator_does(known) -> None:
    rows = [h for h in known if h.name in ("gps_stuck", "gps_north_stuck", "motor_x_off")]
    share = np.full(len(rows), 0.5)
    noise = dict(
        zip((h.name for h in rows), report_faults(rows, share, {2: 0.3}).noise_m, strict=True)
    )
    assert noise == {"gps_stuck": 0.3, "gps_north_stuck": 0.3, "motor_x_off": 0.0}
    assert not report_faults(rows, share, {}).noise_m.any()
