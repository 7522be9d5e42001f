"""mavutil, which MAVProxy and many scripts are made of, against a real vehicle process."""

from collections.abc import Iterator

import pytest
from pymavlink import mavutil
from rover_process import PATIENCE_S, RoverProcess, rover_process


@pytest.fixture
def rover() -> Iterator[RoverProcess]:
    with rover_process() as process:
        yield process


@pytest.fixture
def client(rover: RoverProcess) -> Iterator[mavutil.mavfile]:
    where = f"udpin:127.0.0.1:{rover.mavlink_port}"
    connection = mavutil.mavlink_connection(where, source_system=250, source_component=190)
    rover.advance(1.5)
    connection.wait_heartbeat(timeout=PATIENCE_S)
    yield connection
    connection.close()


def message(client: mavutil.mavfile, kind: str) -> mavutil.mavlink.MAVLink_message:
    received = client.recv_match(type=kind, blocking=True, timeout=PATIENCE_S)
    assert received is not None, f"no {kind}"
    return received


def test_it_is_an_ardupilot_rover(client: mavutil.mavfile) -> None:
    assert client.target_system == 2
    assert client.messages["HEARTBEAT"].type == mavutil.mavlink.MAV_TYPE_GROUND_ROVER
    assert client.flightmode == "HOLD"
    assert client.mode_mapping()["GUIDED"] == 15


def test_mode_arm_and_disarm(rover: RoverProcess, client: mavutil.mavfile) -> None:
    client.set_mode("GUIDED")
    client.arducopter_arm()
    rover.advance(1.0)
    acks = [message(client, "COMMAND_ACK") for _ in range(2)]
    assert [a.result for a in acks] == [0, 0]
    while client.flightmode != "GUIDED" or not client.motors_armed():
        message(client, "HEARTBEAT")
    client.arducopter_disarm()
    rover.advance(1.0)
    while client.motors_armed():
        message(client, "HEARTBEAT")


def test_parameters(client: mavutil.mavfile) -> None:
    client.param_fetch_all()
    count = message(client, "PARAM_VALUE").param_count
    names = {message(client, "PARAM_VALUE").param_id for _ in range(count - 1)}
    assert "SYSID_MYGCS" in names
    client.param_set_send("WP_SPEED", 0.5)
    echoed = message(client, "PARAM_VALUE")
    assert (echoed.param_id, echoed.param_value) == ("WP_SPEED", 0.5)


def test_telemetry_makes_sense(rover: RoverProcess, client: mavutil.mavfile) -> None:
    rover.advance(2.0)
    assert message(client, "GPS_RAW_INT").fix_type in (1, 6)
    assert abs(message(client, "LOCAL_POSITION_NED").x) < 0.2
    assert message(client, "GLOBAL_POSITION_INT").lat == pytest.approx(473977420, abs=20)
    assert message(client, "BATTERY_STATUS").battery_remaining == 100
    assert message(client, "HOME_POSITION").altitude == pytest.approx(488000, abs=200)
