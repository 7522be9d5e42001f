"""MAVSDK against a quadcopter: all axes, and a mission from the ground to the ground."""

import asyncio
import logging
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

from hil.airframe import QUAD_X
from hil.mavlink import CopterMode

pytestmark = pytest.mark.filterwarnings("ignore")  # the client's own are not ours to judge

SPEED = 4.0
GLOBAL_RELATIVE_INT, WAY_POINT, LAND, TAKE_OFF = 6, 16, 21, 22
IN_AIR, ON_GROUND = "IN_AIR", "ON_GROUND"


async def is_at(quad: Any, north_m: float, east_m: float, down_m: float) -> None:
    def there(p: Any) -> bool:
        at = p.position
        errors = (at.north_m - north_m, at.east_m - east_m, at.down_m - down_m)
        return sum(e * e for e in errors) < 0.5**2

    await first(quad.telemetry.position_velocity_ned(), there)


async def flies(quad: Any, north_mps: float, east_mps: float, down_mps: float) -> None:
    def does(p: Any) -> bool:
        at = p.velocity
        errors = (at.north_m_s - north_mps, at.east_m_s - east_mps, at.down_m_s - down_mps)
        return sum(e * e for e in errors) < 0.3**2

    await first(quad.telemetry.position_velocity_ned(), does)


async def lands(quad: Any) -> None:
    await first(quad.telemetry.landed_state(), lambda s: s.name == ON_GROUND)
    await first(quad.telemetry.armed(), lambda armed: not armed)


async def up(quad: Any) -> None:
    await quad.param.set_param_float("RTL_ALT", 300.0)
    await quad.action.set_takeoff_altitude(3.0)
    await armed_with_a_text(quad)
    await first(quad.telemetry.armed(), bool)
    await quad.action.takeoff()
    await first(quad.telemetry.landed_state(), lambda s: s.name == IN_AIR)
    assert await first(quad.telemetry.in_air(), bool)
    await is_at(quad, 0.0, 0.0, -3.0)


async def guided(quad: Any) -> None:
    offboard, velocity = quad.offboard, mavsdk.offboard.VelocityNedYaw
    await offboard.set_velocity_ned(velocity(1.0, 0.0, 0.0, 0.0))
    await offboard.start()
    await first(quad.telemetry.flight_mode(), lambda m: m.name == "OFFBOARD")
    for axes in ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)):
        await offboard.set_velocity_ned(velocity(*axes, 0.0))
        await flies(quad, *axes)
    body = mavsdk.offboard.VelocityBodyYawspeed(-1.0, 0.0, 0.0, 0.0)  # the heading is still north
    await offboard.set_velocity_body(body)
    await flies(quad, -1.0, 0.0, 0.0)
    await offboard.set_position_ned(mavsdk.offboard.PositionNedYaw(1.0, 2.0, -4.0, 0.0))
    await is_at(quad, 1.0, 2.0, -4.0)
    await offboard.stop()


async def goto_and_home(quad: Any) -> None:
    home = await first(quad.telemetry.home())
    lat, lon = home.latitude_deg + 2.0 * NORTH_DEG, home.longitude_deg
    await quad.action.goto_location(lat, lon, home.absolute_altitude_m + 5.0, 0.0)
    await is_at(quad, 2.0, 0.0, -5.0)
    await quad.action.return_to_launch()
    await lands(quad)


async def mission(quad: Any) -> None:
    home = await first(quad.telemetry.home())
    lat, lon = round(home.latitude_deg * 1e7), round(home.longitude_deg * 1e7)
    north = round((home.latitude_deg + 2.0 * NORTH_DEG) * 1e7)
    rows = ((WAY_POINT, lat, 0.0), (TAKE_OFF, lat, 2.0), (WAY_POINT, north, 3.0), (LAND, lat, 0.0))
    items = [
        mavsdk.mission_raw.MissionItem(
            seq, GLOBAL_RELATIVE_INT, command, int(seq == 0), 1, 0.0, 0.0, 0.0, 0.0, x, lon, z, 0
        )
        for seq, (command, x, z) in enumerate(rows)
    ]
    await quad.mission_raw.upload_mission(items)
    assert len(await quad.mission_raw.download_mission()) == len(items)
    await quad.action.arm()
    await quad.mission_raw.start_mission()
    await first(quad.mission_raw.mission_progress(), lambda p: p.current == 2)
    await is_at(quad, 2.0, 0.0, -3.0)
    await lands(quad)
    await quad.mission_raw.clear_mission()
    assert len(await quad.mission_raw.download_mission()) <= 1  # item 0 is home


async def flown_by_hand(quad: Any, ports: Ports) -> None:
    """Up, forward and handed back, in STABILIZE; z is the throttle, its middle hovers."""
    bottom, climb, ahead = (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.6, 0.0), (0.4, 0.0, 0.5, 0.0)
    set_mode(ports, CopterMode.STABILIZE)
    await first(quad.telemetry.flight_mode(), lambda m: m.name == "STABILIZED")
    await by_hand(quad, bottom, quad.action.arm())
    height = quad.telemetry.position_velocity_ned()
    await by_hand(quad, climb, first(height, lambda p: p.position.down_m < -2.0))
    speed = quad.telemetry.position_velocity_ned()
    await by_hand(quad, ahead, first(speed, lambda p: p.velocity.north_m_s > 1.0))
    await quad.action.land()
    await lands(quad)


async def everything(ports: Ports) -> None:
    async with connected(f"udpin://127.0.0.1:{ports.mavlink}") as quad:
        await telemetry(quad, QUAD_X.battery.full_v)
        await parameters(quad)
        await rates(quad)
        await geofence(quad)
        await up(quad)
        await guided(quad)
        await goto_and_home(quad)
        await mission(quad)
        await flown_by_hand(quad, ports)
        await failures(quad, ports)


def test_mavsdk_and_a_quadcopter(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG), lone_vehicle(tmp_path, QUAD_X.name, SPEED) as ports:
        asyncio.run(everything(ports))
    assert troubles(caplog.records) == []
