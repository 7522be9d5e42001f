"""A board in HIL mode in the world: the process, and a peer that speaks MAVLink on loopback."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from free_ports import free_ports
from pymavlink import mavutil

from hil.frames import ned_to_wgs84
from hil.lifeline import dying_with_parent
from hil.scenario import Scenario

PATIENCE_S = 60.0


def test_a_board_joins_gets_sensors_and_drives(tmp_path: Path) -> None:
    """2 s of full throttle ahead: it has moved, and a disarmed board stands."""
    (port,) = free_ports(1)
    board_vehicle = {
        "name": "board",
        "sysid": 1,
        "airframe": "skid_steer",
        "physics": "hil",
        "start": {"north_m": 1.0, "east_m": 2.0},
        "goal": {"north_m": 1.0, "east_m": 2.0},
    }
    arena = {"north_min_m": -20, "north_max_m": 20, "east_min_m": -20, "east_max_m": 20}
    scenario = Scenario.model_validate(
        {"name": "hil_board", "yaw": "free", "arena": arena, "fleet": [board_vehicle]}
    )
    file = tmp_path / "scenario.yaml"
    file.write_text(yaml.safe_dump(scenario.model_dump(mode="json", exclude_none=True)))
    argv = (sys.executable, "-m", "hil.cli", "world", str(file), "--speed", "0")
    ports = ("--physics-port", str(port))
    board = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=9)
    with subprocess.Popen(
        (*argv, *ports), stdout=subprocess.PIPE, preexec_fn=dying_with_parent()
    ) as world:
        try:
            assert world.stdout is not None
            assert world.stdout.readline() == b"ready\n"
            board.mav.heartbeat_send(10, 12, 0, 0, 0)
            first = _next(board, "HIL_SENSOR")
            still = _go_on(board, armed=False, steps=200)
            moved = _go_on(board, armed=True, steps=400)
        finally:
            board.close()
            world.send_signal(signal.SIGTERM)
    lat_deg, lon_deg = ned_to_wgs84(1.0, 2.0, scenario.origin.origin())
    assert (still.lat, still.lon) == pytest.approx((lat_deg * 1e7, lon_deg * 1e7), abs=2)
    assert moved.time_usec - first.time_usec >= 2_800_000
    assert (moved.lat - still.lat) * 0.0111 > 1.0  # metres
    assert moved.vn > 100  # cm/s


def _next(board: "mavutil.mavudp", name: str) -> object:
    message = board.recv_match(type=name, blocking=True, timeout=PATIENCE_S)
    assert message is not None
    return message


def _go_on(board: "mavutil.mavudp", armed: bool, steps: int) -> object:
    """Answer so many HIL_SENSORs; the last HIL_GPS that came."""
    fix = None
    for k in range(steps):
        board.mav.hil_actuator_controls_send(k, [1.0] * 16, 128 if armed else 0, 0)
        while True:
            message = _next(board, ["HIL_SENSOR", "HIL_GPS"])
            if message.get_type() == "HIL_SENSOR":
                break
            fix = message
    assert fix is not None
    return fix
