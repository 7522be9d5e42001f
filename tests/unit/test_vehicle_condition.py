"""Telemetry that is sent only when asked for: inertial sensors, filter, ESCs, head-up figures."""

import math
import statistics

import pytest
from vehicle_harness import Harness

from hil.mavlink import (
    EkfFlag,
    EkfStatus,
    EscTelemetry,
    Message,
    MessageId,
    RawImu,
    RequestDataStream,
    ScaledImu,
    VfrHud,
)
from hil.scenario import Scenario

ON_REQUEST: dict[MessageId, type[Message]] = {
    MessageId.RAW_IMU: RawImu,
    MessageId.SCALED_IMU: ScaledImu,
    MessageId.EKF_STATUS_REPORT: EkfStatus,
    MessageId.ESC_TELEMETRY_1_TO_4: EscTelemetry,
    MessageId.VFR_HUD: VfrHud,
}


@pytest.fixture
def rover(rescue: Scenario) -> Harness:
    harness = Harness(rescue)
    harness.run(1.5)
    return harness


def test_nothing_of_it_is_streamed_unprompted(rover: Harness) -> None:
    rover.guided()
    rover.run(3.0, (0.5, 0.0))
    kinds = {type(r.value) for r in rover.received()}
    assert not kinds & set(ON_REQUEST.values())


@pytest.mark.parametrize("number", ON_REQUEST)
def test_each_can_be_asked_for_once_and_at_a_rate(rover: Harness, number: MessageId) -> None:
    answers = rover.tell(rover.station.request_message(2, number))
    assert isinstance(answers[1].value, ON_REQUEST[number])
    rover.tell(rover.station.set_message_interval(2, number, 10.0))
    rover.run(2.0)
    assert len(rover.values(ON_REQUEST[number])) in (20, 21)


def test_the_old_way_asks_for_them_by_group(rover: Harness) -> None:
    rover.tell(rover.station.encode(RequestDataStream(2, 1, 0, 4, True)))
    rover.run(2.0)
    kinds = {type(r.value) for r in rover.received()}
    assert set(ON_REQUEST.values()) - kinds == {ScaledImu}


def test_imu_at_rest(rover: Harness) -> None:
    rover.tell(rover.station.set_message_interval(2, MessageId.RAW_IMU, 50.0))
    rover.run(2.0)
    samples = rover.values(RawImu)
    down = [s.accel_mps2[2] for s in samples]
    assert statistics.mean(down) == pytest.approx(-9.81, abs=0.05)
    assert statistics.mean(s.gyro_radps[2] for s in samples) == pytest.approx(0.0, abs=0.01)
    heading = [math.atan2(-s.mag_gauss[1], s.mag_gauss[0]) for s in samples]
    assert statistics.mean(heading) == pytest.approx(rover.yaw_rad, abs=0.02)


def test_the_filter_reports_how_well_fixes_fit(rescue: Scenario) -> None:
    rover = Harness(rescue)
    rover.run(0.1)
    rover.tell(rover.station.request_message(2, MessageId.EKF_STATUS_REPORT))
    (before,) = rover.values(EkfStatus)
    assert before.flags & EkfFlag.CONST_POS_MODE
    rover.run(2.0)
    rover.tell(rover.station.request_message(2, MessageId.EKF_STATUS_REPORT))
    (after,) = rover.values(EkfStatus)
    assert after.flags == 831
    assert 0.0 < after.position_ratio < 1.0
    rover.position_m[0] += 5.0
    rover.run(0.1)
    rover.tell(rover.station.request_message(2, MessageId.EKF_STATUS_REPORT))
    assert rover.values(EkfStatus)[0].position_ratio > 5.0


def test_hud_and_escs_of_a_drive(rover: Harness) -> None:
    rover.guided()
    rover.run(3.0, (0.5, 0.0))
    rover.tell(rover.station.request_message(2, MessageId.VFR_HUD))
    (hud,) = rover.values(VfrHud)
    assert hud.groundspeed_mps == pytest.approx(0.5, abs=0.15)
    assert hud.alt_m == pytest.approx(488.0, abs=0.2)
    assert 0.1 < hud.throttle < 0.5
    rover.tell(rover.station.request_message(2, MessageId.ESC_TELEMETRY_1_TO_4))
    (telemetry,) = rover.values(EscTelemetry)
    assert [e.rpm > 500 for e in telemetry.escs] == [True, True, False, False]
    assert all(e.voltage_v == pytest.approx(25.1, abs=0.2) for e in telemetry.escs)
    assert telemetry.escs[0].count == 59


def test_a_broken_motor_is_silent_in_the_esc_telemetry(rescue: Scenario) -> None:
    told = []
    for motors in ((), (1, 2)):
        rover = Harness(rescue)
        for motor in motors:
            rover.inject(101, 1, motor)
        rover.guided()
        rover.run(0.04, (0.5, 0.0))
        rover.tell(rover.station.request_message(2, MessageId.ESC_TELEMETRY_1_TO_4))
        told += rover.values(EscTelemetry)
    assert told[0] == told[1]
