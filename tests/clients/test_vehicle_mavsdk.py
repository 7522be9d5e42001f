"""MAVSDK, as a process of its own, against a vehicle in the real world process."""

import asyncio
import logging
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from lone_vehicle import PATIENCE_S, SYSID, Ports, lone_vehicle

from hil.airframe import OMNI_PLUS, OMNI_X, SKID_STEER, Airframe
from hil.mavlink import Encoder

mavsdk = pytest.importorskip("mavsdk_grpc")
pytestmark = pytest.mark.filterwarnings("ignore")  # the client's own are not ours to judge

SPEED = 3.0
NORTH_DEG = 1.0 / 111_319.5  # of a metre
WAY_POINT, GLOBAL_RELATIVE_INT, MISSION = 16, 6, 0


def free_tcp_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def first(stream: AsyncIterator[Any], wanted: Callable[[Any], bool] = lambda _: True) -> Any:
    async def search() -> Any:
        async for value in stream:
            if wanted(value):
                return value
        raise AssertionError("the stream ended")

    return await asyncio.wait_for(search(), PATIENCE_S)


@asynccontextmanager
async def connected(address: str) -> AsyncIterator[Any]:
    system = mavsdk.System(port=free_tcp_port())
    try:
        await system.connect(address)
        await first(system.core.connection_state(), lambda state: state.is_connected)
        yield system
    finally:
        system._stop_mavsdk_server()


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


async def telemetry(rover: Any, full_v: float) -> None:
    await first(rover.telemetry.health(), lambda h: h.is_local_position_ok and h.is_armable)
    assert (await first(rover.telemetry.home())).absolute_altitude_m == pytest.approx(488, abs=0.3)
    assert (await first(rover.telemetry.gps_info())).num_satellites == 18
    assert (await first(rover.telemetry.battery())).voltage_v == pytest.approx(full_v, abs=0.3)
    assert not await first(rover.telemetry.in_air())
    await rover.telemetry.set_rate_position_velocity_ned(20.0)
    await rover.telemetry.set_rate_scaled_imu(10.0)
    imu = await first(rover.telemetry.scaled_imu())
    assert abs(imu.acceleration_frd.forward_m_s2) < abs(imu.acceleration_frd.down_m_s2)
    assert (await rover.info.get_version()).flight_sw_major == 4


async def parameters(rover: Any) -> None:
    await rover.param.set_param_float("FS_TIMEOUT", 6.0)
    assert await rover.param.get_param_float("FS_TIMEOUT") == 6.0
    await rover.param.set_param_int("FENCE_ACTION", 1)
    assert await rover.param.get_param_int("FENCE_ACTION") == 1
    everything = await rover.param.get_all_params()
    assert "WP_SPEED" in {p.name for p in everything.float_params}
    with pytest.raises(mavsdk.param.ParamError):
        await rover.param.get_param_float("SIM_GPS1_NOISE")


async def armed_with_a_text(rover: Any) -> None:
    """Nobody tells when a subscription has begun, so arm until a text has come through it."""
    texts = first(rover.telemetry.status_text(), lambda t: t.text == "Throttle armed")
    heard = asyncio.ensure_future(texts)
    while not heard.done():
        await rover.action.disarm()
        await rover.action.arm()
        await asyncio.wait({heard}, timeout=1.0)
    assert heard.result().text == "Throttle armed"


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


async def failures(rover: Any, ports: Ports) -> None:
    """On the station's port it does not exist; on the injector's it works, behind its gate."""
    unit, kind = mavsdk.failure.FailureUnit, mavsdk.failure.FailureType
    with pytest.raises(mavsdk.failure.FailureError, match="UNSUPPORTED"):
        await rover.failure.inject(unit.SYSTEM_MOTOR, kind.OFF, 1)
    async with connected(f"udpout://127.0.0.1:{ports.injector}") as injector:
        await injections(rover, injector, ports)


async def injections(rover: Any, injector: Any, ports: Ports) -> None:
    unit, kind = mavsdk.failure.FailureUnit, mavsdk.failure.FailureType
    with pytest.raises(mavsdk.failure.FailureError, match="DENIED"):
        await injector.failure.inject(unit.SYSTEM_MOTOR, kind.OFF, 1)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        gate = Encoder(251, 190).param_set(SYSID, "SYS_FAILURE_EN", 1.0)
        sock.settimeout(PATIENCE_S)
        sock.sendto(gate, ("127.0.0.1", ports.injector))
        sock.recv(300)
    await injector.failure.inject(unit.SYSTEM_MOTOR, kind.OFF, 0)
    await injector.failure.inject(unit.SENSOR_GPS, kind.OFF, 0)
    await first(rover.telemetry.gps_info(), lambda g: g.fix_type.value <= 1)
    await injector.failure.inject(unit.SYSTEM_MOTOR, kind.OK, 0)
    await injector.failure.inject(unit.SENSOR_GPS, kind.OK, 0)
    await first(rover.telemetry.gps_info(), lambda g: g.fix_type.value > 1)


async def everything(ports: Ports, airframe: Airframe) -> None:
    async with connected(f"udpin://127.0.0.1:{ports.mavlink}") as rover:
        await telemetry(rover, airframe.battery.full_v)
        await parameters(rover)
        await guided(rover, airframe.steering == "omni")
        await goto(rover)
        await mission(rover)
        await rover.action.disarm()
        await first(rover.telemetry.armed(), lambda armed: not armed)
        await failures(rover, ports)


@pytest.mark.parametrize("airframe", [OMNI_PLUS, OMNI_X, SKID_STEER], ids=lambda a: a.name)
def test_mavsdk_and_a_rover(
    airframe: Airframe, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG), lone_vehicle(tmp_path, airframe.name, SPEED) as ports:
        asyncio.run(everything(ports, airframe))
    told = [(r.levelname, r.getMessage()) for r in caplog.records]
    assert told
    assert [t for t in told if t[0] in ("WARNING", "ERROR") or "imeout" in t[1]] == []
