"""MAVSDK against a quadcopter: all axes, and a mission from the ground to the ground."""

import asyncio
import logging
from pathlib import Path
from typing import Any

import pytest
from lone_vehicle import Ports, lone_vehicle
from test_vehicle_mavsdk import NORTH_DEG, connected, first, injections

mavsdk = pytest.importorskip("mavsdk_grpc")
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
    await first(quad.telemetry.health(), lambda h: h.is_local_position_ok and h.is_armable)
    await quad.telemetry.set_rate_position_velocity_ned(20.0)
    await quad.param.set_param_float("RTL_ALT", 300.0)
    assert await quad.param.get_param_float("RTL_ALT") == 300.0
    await quad.action.set_takeoff_altitude(3.0)
    await quad.action.arm()
    await quad.action.takeoff()
    await first(quad.telemetry.landed_state(), lambda s: s.name == IN_AIR)
    await is_at(quad, 0.0, 0.0, -3.0)


async def guided(quad: Any) -> None:
    offboard, velocity = quad.offboard, mavsdk.offboard.VelocityNedYaw
    await offboard.set_velocity_ned(velocity(1.0, 0.0, 0.0, 0.0))
    await offboard.start()
    for axes in ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)):
        await offboard.set_velocity_ned(velocity(*axes, 0.0))
        await flies(quad, *axes)
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
    await is_at(quad, 2.0, 0.0, -3.0)
    await lands(quad)
    await quad.mission_raw.clear_mission()


async def everything(ports: Ports) -> None:
    async with connected(f"udpin://127.0.0.1:{ports.mavlink}") as quad:
        await up(quad)
        await guided(quad)
        await goto_and_home(quad)
        await mission(quad)
        async with connected(f"udpout://127.0.0.1:{ports.injector}") as injector:
            await injections(quad, injector, ports)


def test_mavsdk_and_a_quadcopter(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.DEBUG), lone_vehicle(tmp_path, "quad_x", SPEED) as ports:
        asyncio.run(everything(ports))
    told = [(r.levelname, r.getMessage()) for r in caplog.records]
    assert told
    assert [t for t in told if t[0] in ("WARNING", "ERROR") or "imeout" in t[1]] == []
