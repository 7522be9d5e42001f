"""MAVSDK, as a process of its own, against a rover in the real world process."""

import asyncio
import logging
import math
from pathlib import Path
from typing import Any

import pytest
from lone_vehicle import Ports, lone_vehicle
from mavsdk_client import (
    NORTH_DEG,
    armed_with_a_text,
    by_hand,
    connected,
    failures,
    first,
    geofence,
    mavsdk,
    parameters,
    rates,
    set_mode,
    telemetry,
    troubles,
)

from hil.airframe import OMNI_PLUS, OMNI_X, SKID_STEER, Airframe
from hil.mavlink import RoverMode

pytestmark = pytest.mark.filterwarnings("ignore")  # the client's own are not ours to judge

SPEED = 3.0
WAY_POINT, GLOBAL_RELATIVE_INT, MISSION = 16, 6, 0


async def reaches(rover: Any, north_m: float, east_m: float) -> None:
    def is_there(p: Any) -> bool:
        north, east = p.position.north_m - north_m, p.position.east_m - east_m
        return bool(north * north + east * east < 0.3**2)

    await first(rover.telemetry.position_velocity_ned(), is_there)


async def moves(rover: Any, north_mps: float, east_mps: float) -> None:
    def does(p: Any) -> bool:
        north, east = p.velocity.north_m_s - north_mps, p.velocity.east_m_s - east_mps
        return bool(north * north + east * east < 0.15**2)

    await first(rover.telemetry.position_velocity_ned(), does)


async def guided(rover: Any, sideways: bool) -> None:
    offboard = rover.offboard
    await armed_with_a_text(rover)
    await first(rover.telemetry.armed(), bool)
    await offboard.set_velocity_ned(mavsdk.offboard.VelocityNedYaw(0.5, 0.0, 0.0, 0.0))
    await offboard.start()
    await moves(rover, 0.5, 0.0)
    await offboard.set_velocity_ned(mavsdk.offboard.VelocityNedYaw(0.0, -0.5, 0.0, 0.0))
    await moves(rover, 0.0, -0.5)
    if sideways:  # the heading is still north
        await offboard.set_velocity_body(mavsdk.offboard.VelocityBodyYawspeed(-0.5, 0.0, 0.0, 0.0))
        await moves(rover, -0.5, 0.0)
    await offboard.set_position_ned(mavsdk.offboard.PositionNedYaw(1.0, 1.0, 0.0, 0.0))
    await reaches(rover, 1.0, 1.0)
    await offboard.stop()


async def goto(rover: Any) -> None:
    home = await first(rover.telemetry.home())
    lat, lon = home.latitude_deg + 2.0 * NORTH_DEG, home.longitude_deg
    await rover.action.goto_location(lat, lon, home.absolute_altitude_m, 0.0)
    await reaches(rover, 2.0, 0.0)


def item(seq: int, lat_deg: float, lon_deg: float) -> Any:
    x, y = round(lat_deg * 1e7), round(lon_deg * 1e7)
    frame = GLOBAL_RELATIVE_INT
    return mavsdk.mission_raw.MissionItem(
        seq, frame, WAY_POINT, int(seq == 0), 1, 0.0, 0.0, 0.0, 0.0, x, y, 0.0, MISSION
    )


async def mission(rover: Any) -> None:
    home = await first(rover.telemetry.home())
    lat, lon = home.latitude_deg, home.longitude_deg
    items = [item(0, lat, lon), item(1, lat, lon), item(2, lat - NORTH_DEG, lon)]
    await rover.mission_raw.upload_mission(items)
    back = await rover.mission_raw.download_mission()
    assert [(i.x, i.y) for i in back[1:]] == [(i.x, i.y) for i in items[1:]]
    await rover.mission_raw.start_mission()
    await first(rover.mission_raw.mission_progress(), lambda p: p.current == 2)
    await reaches(rover, -1.0, 0.0)
    await rover.mission_raw.pause_mission()
    await rover.mission_raw.clear_mission()
    assert len(await rover.mission_raw.download_mission()) <= 1  # item 0 is home
    await rover.action.hold()
    await rover.action.return_to_launch()
    await reaches(rover, 0.0, 0.0)


async def driven_by_hand(rover: Any, ports: Ports) -> None:
    """A joystick in MANUAL; z is the throttle."""
    set_mode(ports, RoverMode.MANUAL)
    await first(rover.telemetry.flight_mode(), lambda m: m.name == "MANUAL")
    seen = rover.telemetry.velocity_ned()
    await by_hand(rover, (0.0, 0.0, 0.6, 0.0), first(seen, lambda v: speed(v) > 0.3))
    await rover.action.hold()


def speed(velocity: Any) -> float:
    return math.hypot(velocity.north_m_s, velocity.east_m_s)


async def everything(ports: Ports, airframe: Airframe) -> None:
    async with connected(f"udpin://127.0.0.1:{ports.mavlink}") as rover:
        await telemetry(rover, airframe.battery.full_v)
        await parameters(rover)
        await rates(rover)
        await geofence(rover)
        await guided(rover, airframe.steering == "omni")
        await goto(rover)
        await mission(rover)
        await driven_by_hand(rover, ports)
        await rover.action.disarm()
        await first(rover.telemetry.armed(), lambda armed: not armed)
        await failures(rover, ports)


@pytest.mark.parametrize("airframe", [OMNI_PLUS, OMNI_X, SKID_STEER], ids=lambda a: a.name)
def test_mavsdk_and_a_rover(
    airframe: Airframe, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG), lone_vehicle(tmp_path, airframe.name, SPEED) as ports:
        asyncio.run(everything(ports, airframe))
    assert troubles(caplog.records) == []
