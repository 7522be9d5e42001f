"""HIL messages, read by pymavlink on a loopback socket as a board would."""

import math
import socket

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import common

from hil.frames import Origin, ned_to_wgs84
from hil.hil_link import HilLink
from hil.physics_link import PhysicsState

ORIGIN = Origin(47.397742, 8.545594, 488.0)
STATE = PhysicsState(
    12.5, (0.01, -0.02, 0.3), (0.5, 0.1, -9.8), (3.0, -4.0, -2.0), (0.6, -0.8, 0.1), (0, 0, 1.0)
)


def test_a_board_on_loopback_reads_sensors_and_moves_motors() -> None:
    link = HilLink(ORIGIN)
    board = mavutil.mavlink_connection("udpin:127.0.0.1:0", source_system=9)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as world:
        world.settimeout(5.0)
        try:
            world.sendto(link.sensor(STATE) + link.gps(STATE), board.port.getsockname())
            sensor = board.recv_match(type="HIL_SENSOR", blocking=True, timeout=5.0)
            gps = board.recv_match(type="HIL_GPS", blocking=True, timeout=5.0)
            assert sensor.time_usec == 12_500_000
            accel = (sensor.xacc, sensor.yacc, sensor.zacc)
            assert accel == pytest.approx(STATE.accel_body_mps2, abs=1e-6)
            assert sensor.zgyro == pytest.approx(0.3, abs=1e-6)
            assert math.atan2(-sensor.ymag, sensor.xmag) == pytest.approx(1.0, abs=1e-6)
            assert sensor.pressure_alt == pytest.approx(490.0)
            lat, lon = ned_to_wgs84(3.0, -4.0, ORIGIN)
            assert (gps.lat, gps.lon) == (round(lat * 1e7), round(lon * 1e7))
            assert (gps.vn, gps.ve, gps.vel) == (60, -80, 100)
            controls = [0.5, -0.25, float("nan")] + [0.0] * 13
            board.mav.hil_actuator_controls_send(12_520_000, controls, 128, 0)
            (heard,) = link.controls(world.recv(1000))
            assert heard.pwm_us[:4] == (1700, 1400, 0, 1500)
        finally:
            board.close()


def test_a_disarmed_board_and_noise_move_nothing() -> None:
    link, board = HilLink(ORIGIN), common.MAVLink(None, srcSystem=9)
    message = common.MAVLink_hil_actuator_controls_message(1, [1.0] * 16, 0, 0)
    (heard,) = link.controls(b"\xfd\x01noise" + message.pack(board) + message.pack(board)[:5])
    assert set(heard.pwm_us) == {0}
    assert link.controls(b"") == []
