"""Arming, modes, time-outs and failsafes, as pure transitions."""

import pytest

from hil.mavlink import Result, RoverMode, SystemStatus
from sim_vehicles.autopilot import (
    Autopilot,
    Failsafe,
    Readiness,
    Target,
    accept_target,
    arm,
    check,
    check_sticks,
    check_target,
    disarm,
    set_mode,
    system_status,
)

READY, NOT_READY = Readiness(True), Readiness(False)
GUIDED = Autopilot(RoverMode.GUIDED, armed=True)
VELOCITY = Target(10.0, velocity_mps=(0.5, 0.0))
POSITION = Target(10.0, position_m=(3.0, 0.0))


def test_arming_waits_for_the_estimator_and_says_so() -> None:
    refused = arm(Autopilot(), NOT_READY)
    assert (refused.state.armed, refused.result) == (False, Result.FAILED)
    assert "position" in refused.texts[0].text
    assert arm(Autopilot(), READY).state.armed


def test_arming_twice_is_fine_and_silent() -> None:
    again = arm(GUIDED, NOT_READY)
    assert (again.state, again.result, again.texts) == (GUIDED, Result.ACCEPTED, ())


def test_disarming_always_works_and_forgets_the_target() -> None:
    state = disarm(accept_target(GUIDED, VELOCITY)).state
    assert (state.armed, state.target, state.drives) == (False, None, False)


def test_every_complaint_against_arming_is_told() -> None:
    refused = arm(Autopilot(), Readiness(False, complaints=("vehicle outside fence",)))
    assert refused.result is Result.FAILED
    assert [t.text for t in refused.texts] == [
        "Arm: waiting for position estimate",
        "Arm: vehicle outside fence",
    ]


@pytest.mark.parametrize("mode", [RoverMode.ACRO, RoverMode.SMART_RTL, RoverMode.LOITER])
def test_modes_that_are_not_there_are_refused(mode: RoverMode) -> None:
    refused = set_mode(GUIDED, mode, READY)
    assert (refused.state, refused.result) == (GUIDED, Result.UNSUPPORTED)


def test_numbers_that_are_no_modes_are_refused() -> None:
    assert set_mode(GUIDED, 99, READY).result is Result.DENIED


def test_guided_needs_a_position() -> None:
    assert set_mode(Autopilot(), RoverMode.GUIDED, NOT_READY).result is Result.FAILED
    assert set_mode(Autopilot(), RoverMode.GUIDED, READY).state.mode is RoverMode.GUIDED


def test_a_mode_change_forgets_the_target_and_hold_drives_nothing() -> None:
    held = set_mode(accept_target(GUIDED, VELOCITY), RoverMode.HOLD, READY).state
    assert (held.target, held.drives) == (None, False)


def test_targets_count_only_in_guided() -> None:
    assert accept_target(Autopilot(RoverMode.HOLD, armed=True), VELOCITY).target is None
    assert accept_target(GUIDED, VELOCITY).target == VELOCITY


def test_a_velocity_times_out_with_a_text_and_a_position_does_not() -> None:
    driving = accept_target(GUIDED, VELOCITY)
    assert check_target(driving, 13.0).state == driving
    stopped = check_target(driving, 13.02)
    assert stopped.state.target is None
    assert "stopping" in stopped.texts[0].text
    arriving = accept_target(GUIDED, POSITION)
    assert check_target(arriving, 100.0).state == arriving


def test_auto_needs_a_mission() -> None:
    assert set_mode(GUIDED, RoverMode.AUTO, READY).result is Result.FAILED
    ready = Readiness(True, mission=True)
    assert set_mode(GUIDED, RoverMode.AUTO, ready).state.mode is RoverMode.AUTO


@pytest.mark.parametrize("which", Failsafe)
def test_a_failsafe_acts_once_and_clearing_it_does_not_resume(which: Failsafe) -> None:
    driving = accept_target(GUIDED, VELOCITY)
    tripped = check(driving, which, True, RoverMode.HOLD)
    assert (tripped.state.mode, tripped.state.target) == (RoverMode.HOLD, None)
    assert system_status(tripped.state, ready=True) is SystemStatus.CRITICAL
    assert tripped.texts[0].text == f"{which.value}: Hold"
    overruled = Autopilot(RoverMode.MANUAL, True, tripped.state.tripped)
    assert check(overruled, which, True, RoverMode.HOLD).state == overruled
    back = check(tripped.state, which, False, RoverMode.HOLD)
    assert (back.state.mode, back.state.tripped) == (RoverMode.HOLD, frozenset())
    assert back.texts[0].text == f"{which.value} Cleared"


def test_a_failsafe_may_only_report() -> None:
    driving = accept_target(GUIDED, VELOCITY)
    reported = check(driving, Failsafe.FENCE, True, None)
    assert (reported.state.mode, reported.state.target) == (RoverMode.GUIDED, VELOCITY)
    assert reported.texts[0].text == "Fence Breach: Report"


def test_a_failsafe_waits_for_arming() -> None:
    assert check(Autopilot(), Failsafe.GCS, True, RoverMode.HOLD).state == Autopilot()


def test_without_gps_no_mode_that_needs_it() -> None:
    lost = Autopilot(RoverMode.HOLD, True, frozenset({Failsafe.GPS}))
    assert set_mode(lost, RoverMode.GUIDED, READY).result is Result.FAILED
    assert set_mode(lost, RoverMode.MANUAL, READY).result is Result.ACCEPTED


def test_released_sticks_hold_in_manual_only() -> None:
    manual = Autopilot(RoverMode.MANUAL, armed=True)
    assert check_sticks(manual, released=True).state.mode is RoverMode.HOLD
    assert check_sticks(manual, released=False).state == manual
    assert check_sticks(GUIDED, released=True).state == GUIDED


def test_system_status() -> None:
    assert system_status(Autopilot(), ready=False) is SystemStatus.CALIBRATING
    assert system_status(Autopilot(), ready=True) is SystemStatus.STANDBY
    assert system_status(GUIDED, ready=True) is SystemStatus.ACTIVE
