"""A fix that stands while the estimate moves: what that says of each explanation."""

import math
from dataclasses import replace

import numpy as np
import pytest

from base_station import twin
from base_station.autopilots import adapter
from base_station.belief.fixes import UNHEARD_OF, Fixes, has_fix, seen_m, seen_s
from base_station.belief.hindsight import Hindsight
from base_station.belief.hypotheses import Hypothesis, candidates
from base_station.belief.watch import Baseline, Watch
from base_station.execution import hold
from base_station.fitted import fleet_model
from base_station.receiving.fleet import FIX_LAG_S, Fleet
from base_station.receiving.telemetry import Frame, Receivers, Status
from hil.airframe import SKID_STEER
from hil.frames import ned_to_wgs84
from hil.mavlink import (
    COMPONENT_AUTOPILOT,
    EkfFlag,
    FixType,
    GpsOrigin,
    GpsRaw,
    LocalPosition,
    Received,
)
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


@pytest.fixture
def foreign_view(rescue_view: StationView) -> StationView:
    """The same fleet on a firmware whose estimator has an accelerometer, where fixes count."""
    fleet = [m.model_copy(update={"autopilot": "ardupilot"}) for m in rescue_view.fleet]
    diagnosis = rescue_view.diagnosis.model_copy(update={"evidence": "position_and_fixes"})
    return rescue_view.model_copy(update={"fleet": fleet, "diagnosis": diagnosis})


def fix(view: StationView, time_s: float, north_m: float, kind: int = FixType.RTK_FIXED) -> GpsRaw:
    lat_deg, lon_deg = ned_to_wgs84(north_m, 0.0, view.origin.origin())
    return GpsRaw(time_s, kind, lat_deg, lon_deg, 0.0, 1.0, 0.0, 0.0, 10)


def heard(view: StationView, *fixes: GpsRaw) -> Frame:
    """The frame of 1.3 s: all have stood at zero, and `fixes` of #2 came after its first report."""
    fleet, origin = Fleet(view), view.origin
    began = (GpsOrigin(origin.lat_deg, origin.lon_deg, origin.alt_m), _at_zero(1.2))
    for i, member in enumerate(view.fleet):
        for value in (*began, *(fixes if i == 1 else ())):
            fleet.receive(i, Received(member.sysid, COMPONENT_AUTOPILOT, value), wall_s=1.0)
    fleet.start_ticks()
    for i, member in enumerate(view.fleet):
        fleet.receive(i, Received(member.sysid, COMPONENT_AUTOPILOT, _at_zero(1.3)), wall_s=1.0)
    return fleet.due()[-1]


def _at_zero(time_s: float) -> LocalPosition:
    return LocalPosition(time_s, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_a_suspect_is_judged_by_its_fix_at_the_time_it_was_there(foreign_view) -> None:
    frame = heard(foreign_view, fix(foreign_view, 1.0, 2.0), fix(foreign_view, 1.25, 3.0))
    assert seen_m(frame, 1)[1] == pytest.approx([3.0, 0.0], abs=0.02)
    assert seen_s(frame, 1) == pytest.approx(1.25 - FIX_LAG_S)
    assert seen_m(frame, 0)[0] == pytest.approx([0.0, 0.0])  # it has sent none
    assert seen_s(frame, 0) == frame.time_s
    assert frame.position_m[1] == pytest.approx([0.0, 0.0])


def test_a_fix_of_the_future_is_not_known_yet(foreign_view) -> None:
    frame = heard(foreign_view, fix(foreign_view, 1.2, 2.0), fix(foreign_view, 1.7, 3.0))
    assert seen_m(frame, 1)[1, 0] == pytest.approx(2.0, abs=0.02)


def test_a_receiver_that_tells_the_time_of_day_counts_when_it_is_heard(foreign_view) -> None:
    frame = heard(foreign_view, fix(foreign_view, 1.8e9, 2.0))
    assert seen_s(frame, 1) == pytest.approx(1.2 - FIX_LAG_S)


def test_no_fix_and_fixes_that_do_not_count_leave_the_estimate(foreign_view, rescue_view) -> None:
    lost = heard(foreign_view, fix(foreign_view, 1.2, 2.0, FixType.NO_FIX))
    assert not has_fix(lost, 1)
    assert seen_m(lost, 1)[1, 0] == 0.0
    plain = rescue_view.model_copy(update={"diagnosis": foreign_view.diagnosis})
    assert not has_fix(heard(plain, fix(plain, 1.2, 2.0)), 1)  # its estimate is filtered fixes
    assert heard(rescue_view, fix(rescue_view, 1.2, 2.0)).receivers is None


@pytest.mark.parametrize(("receivers", "named"), [(False, False), (True, True)])
def test_an_estimate_that_swings_over_a_stuck_fix_is_the_receiver_s_fault(
    foreign_view, receivers, named
) -> None:
    """ArduPilot's, measured: 0.18 m along with a pulse of 1.5 s, then back to -0.24 m."""
    suspect, period_s = 0, 0.1
    model = fleet_model(foreign_view)
    starts = [[0.0, -2.5], [0.0, 0.0], [0.0, 2.5]]
    watch = Watch(foreign_view, Baseline(model), twin.initial_state(starts, [0.0] * 3), 0.0)
    orders, rng = hold(3), np.random.default_rng(0)
    for k in range(80):
        time_s = period_s * (k + 1)
        position_m = np.array(starts) + 0.005 * rng.standard_normal((3, 2))
        position_m[suspect, 0] += np.interp(time_s, SWING_S, SWING_M)
        told = Receivers(np.array(starts), np.full(3, time_s - 0.15), np.zeros(3, dtype=np.bool_))
        yes, zero = np.ones(3, dtype=np.bool_), np.zeros(3)
        link = (yes, yes, zero, zero, zero, orders.driven)
        frame = Frame(time_s, position_m, np.zeros((3, 2)), zero, *link)
        watch.tick(replace(frame, receivers=told if receivers else None), orders)
        orders = hold(3)
        if 2.0 < time_s < 3.5:
            orders.driven[suspect], orders.setpoints[suspect, 0] = True, 0.5
    known = candidates(foreign_view.fleet[suspect], foreign_view.diagnosis.priors)
    memory = tuple(watch.memory)
    hindsight = Hindsight(watch.baseline, memory, suspect, known, (1.5, 5.0), period_s)
    assert hindsight.take(memory, len(memory))
    verdict = hindsight.doubt().verdict(0.5)
    of_gps = sum(p for name, p in verdict.posterior.items() if name.startswith("gps"))
    assert (of_gps > 0.9) == named


SWING_S = (2.1, 2.6, 3.2, 3.8, 4.2, 4.6, 5.2, 5.8, 7.0, 8.0)
SWING_M = (0.0, 0.05, 0.14, 0.18, 0.05, -0.13, -0.24, -0.22, -0.1, -0.05)
