"""What a station says: masks, targets, sequence numbers."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as reference

from hil.mavlink import Command, Decoder, Encoder, LocalSetpoint, MessageId


def sent(datagram: bytes) -> reference.MAVLink_message:
    return reference.MAVLink(None).decode(bytearray(datagram))


@pytest.mark.parametrize(("yaw_rad", "mask"), [(None, 3527), (0.5, 2503)])
def test_velocity_setpoint_masks(yaw_rad: float | None, mask: int) -> None:
    m = sent(Encoder(250, 190).velocity_setpoint(2, 1500, 0.5, -0.25, yaw_rad))
    assert (m.type_mask, m.coordinate_frame, m.time_boot_ms) == (mask, 1, 1500)
    assert (m.vx, m.vy, m.vz, m.yaw) == (0.5, -0.25, 0.0, yaw_rad or 0.0)
    assert (m.target_system, m.target_component) == (2, 1)


@pytest.mark.parametrize(("yaw_rad", "mask"), [(None, 3576), (0.5, 2552)])
def test_position_setpoint_masks(yaw_rad: float | None, mask: int) -> None:
    m = sent(Encoder(250, 190).position_setpoint(2, 1500, 3.0, -1.0, yaw_rad))
    assert (m.type_mask, m.x, m.y, m.z, m.yaw) == (mask, 3.0, -1.0, 0.0, yaw_rad or 0.0)


def test_commands_fill_unused_params_with_zero() -> None:
    m = sent(Encoder(250, 190).command_long(2, Command.REQUEST_MESSAGE, 148.0))
    assert [m.param1, m.param2, m.param7] == [148.0, 0.0, 0.0]


def test_set_mode_is_a_command_with_an_acknowledgement() -> None:
    m = sent(Encoder(250, 190).set_mode(2, 15))
    assert (m.command, m.param1, m.param2) == (Command.DO_SET_MODE, 1.0, 15.0)


@pytest.mark.parametrize(("hz", "interval_us"), [(10.0, 100_000), (0.0, -1), (math.inf, -1)])
def test_message_interval(hz: float, interval_us: float) -> None:
    m = sent(Encoder(250, 190).set_message_interval(2, MessageId.ATTITUDE, hz))
    assert (m.param1, m.param2) == (30.0, interval_us)


def test_heartbeat_says_ground_station() -> None:
    m = sent(Encoder(250, 190).gcs_heartbeat())
    assert (m.type, m.autopilot, m.base_mode) == (6, 8, 0)


def test_sequence_numbers_count_and_wrap() -> None:
    encoder = Encoder(250, 190)
    numbers = [sent(encoder.gcs_heartbeat()).get_seq() for _ in range(258)]
    assert numbers == [*range(256), 0, 1]


def test_masked_fields_are_none_and_may_be_anything() -> None:
    theirs = reference.MAVLink(None)
    nan = math.nan
    message = reference.MAVLink_set_position_target_local_ned_message(
        0, 2, 1, 1, 3559, nan, nan, nan, 0.5, 0.25, nan, nan, nan, nan, nan, nan
    )
    (received,) = Decoder().decode(message.pack(theirs))
    assert isinstance(received.value, LocalSetpoint)
    assert received.value.velocity_mps == (0.5, 0.25, 0.0)
    assert received.value.position_m is None
    assert (received.value.yaw_rad, received.value.yaw_rate_radps) == (None, None)


@pytest.mark.parametrize("field", range(4))
def test_a_field_that_is_used_must_be_a_number(field: int) -> None:
    numbers = [0.0, 0.0, 0.0, 0.0]
    numbers[field] = math.nan
    north, east, yaw, rate = numbers
    for place in (0, 3):  # position, velocity
        values = [0.0] * 9
        values[place : place + 2] = [north, east]
        mask = 56 if place == 0 else 7
        message = reference.MAVLink_set_position_target_local_ned_message(
            0, 2, 1, 1, mask | 448, *values, yaw, rate
        )
        assert Decoder().decode(message.pack(reference.MAVLink(None))) == []
