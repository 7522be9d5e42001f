"""Arming, modes, time-outs and failsafes, as pure transitions."""

import pytest

from hil.mavlink import Result, RoverMode, SystemStatus
from sim_vehicles.autopilot import (
    Autopilot,
    Target,
    accept_target,
    arm,
    check_gcs,
    check_target,
    disarm,
    set_mode,
    system_status,
)

GUIDED = Autopilot(RoverMode.GUIDED, armed=True)
VELOCITY = Target(10.0, velocity_mps=(0.5, 0.0))
POSITION = Target(10.0, position_m=(3.0, 0.0))


def test_arming_waits_for_the_estimator_and_says_so() -> None:
    refused = arm(Autopilot(), ready=False)
    assert (refused.state.armed, refused.result) == (False, Result.FAILED)
    assert "position" in refused.texts[0].text
    assert arm(Autopilot(), ready=True).state.armed


def test_arming_twice_is_fine_and_silent() -> None:
    again = arm(GUIDED, ready=False)
    assert (again.state, again.result, again.texts) == (GUIDED, Result.ACCEPTED, ())


def test_disarming_always_works_and_forgets_the_target() -> None:
    state = disarm(accept_target(GUIDED, VELOCITY)).state
    assert (state.armed, state.target, state.drives) == (False, None, False)


@pytest.mark.parametrize("mode", [RoverMode.AUTO, RoverMode.RTL, RoverMode.LOITER])
def test_modes_that_are_not_there_are_refused(mode: RoverMode) -> None:
    refused = set_mode(GUIDED, mode, ready=True)
    assert (refused.state, refused.result) == (GUIDED, Result.UNSUPPORTED)


def test_numbers_that_are_no_modes_are_refused() -> None:
    assert set_mode(GUIDED, 99, ready=True).result is Result.DENIED


def test_guided_needs_a_position() -> None:
    assert set_mode(Autopilot(), RoverMode.GUIDED, ready=False).result is Result.FAILED
    assert set_mode(Autopilot(), RoverMode.GUIDED, ready=True).state.mode is RoverMode.GUIDED


def test_a_mode_change_forgets_the_target_and_hold_drives_nothing() -> None:
    held = set_mode(accept_target(GUIDED, VELOCITY), RoverMode.HOLD, ready=True).state
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


def test_losing_the_station_holds_and_its_return_does_not_resume() -> None:
    lost = check_gcs(GUIDED, silence_s=5.1, timeout_s=5.0)
    assert (lost.state.mode, lost.state.gcs_lost) == (RoverMode.HOLD, True)
    assert system_status(lost.state, ready=True) is SystemStatus.CRITICAL
    back = check_gcs(lost.state, silence_s=0.1, timeout_s=5.0)
    assert (back.state.mode, back.state.gcs_lost) == (RoverMode.HOLD, False)


def test_nothing_is_lost_before_there_was_a_station_or_while_disarmed() -> None:
    assert check_gcs(GUIDED, silence_s=None, timeout_s=5.0).state == GUIDED
    assert check_gcs(Autopilot(), silence_s=60.0, timeout_s=5.0).state == Autopilot()


def test_system_status() -> None:
    assert system_status(Autopilot(), ready=False) is SystemStatus.CALIBRATING
    assert system_status(Autopilot(), ready=True) is SystemStatus.STANDBY
    assert system_status(GUIDED, ready=True) is SystemStatus.ACTIVE
