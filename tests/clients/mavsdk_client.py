"""What MAVSDK does with any vehicle: the parts that tests of rovers and quadcopter share."""

import asyncio
import itertools
import math
import socket
import statistics
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from free_ports import free_ports
from lone_vehicle import PATIENCE_S, SYSID, Ports

from hil.mavlink import Encoder

mavsdk = pytest.importorskip("mavsdk_grpc")

NORTH_DEG = 1.0 / 111_319.5  # of a metre
STREAMS = (
    *("position", "home", "in_air", "landed_state", "armed", "attitude_euler"),
    *("attitude_angular_velocity_body", "velocity_ned", "gps_info", "raw_gps", "battery"),
    *("flight_mode", "health", "health_all_ok", "rc_status", "position_velocity_ned", "heading"),
    *("fixedwing_metrics", "scaled_imu", "raw_imu"),
)
RATES = (
    *("position", "home", "in_air", "landed_state", "attitude_euler", "velocity_ned", "gps_info"),
    *("raw_gps", "battery", "rc_status", "position_velocity_ned", "fixedwing_metrics"),
    *("scaled_imu", "raw_imu", "health"),
)


async def first(stream: AsyncIterator[Any], wanted: Callable[[Any], bool] = lambda _: True) -> Any:
    async def search() -> Any:
        async for value in stream:
            if wanted(value):
                return value
        raise AssertionError("the stream ended")

    return await asyncio.wait_for(search(), PATIENCE_S)


@asynccontextmanager
async def connected(address: str) -> AsyncIterator[Any]:
    system = mavsdk.System(port=free_ports(1, kind=socket.SOCK_STREAM)[0])
    try:
        await system.connect(address)
        await first(system.core.connection_state(), lambda state: state.is_connected)
        yield system
    finally:
        system._stop_mavsdk_server()


def from_another_station(ports: Ports, datagram: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        sock.sendto(datagram, ("127.0.0.1", ports.listen))


async def telemetry(vehicle: Any, full_v: float) -> None:
    """Every stream that ArduPilot's messages can feed, on a vehicle at rest."""
    await first(vehicle.telemetry.health(), lambda h: h.is_local_position_ok and h.is_armable)
    for name in RATES:
        await getattr(vehicle.telemetry, f"set_rate_{name}")(5.0)
    values = await asyncio.gather(*(first(getattr(vehicle.telemetry, s)()) for s in STREAMS))
    seen = dict(zip(STREAMS, values, strict=True))
    assert seen["home"].absolute_altitude_m == pytest.approx(488, abs=0.3)
    assert seen["position"].latitude_deg == pytest.approx(47.397742, abs=1e-5)
    assert abs(seen["position"].relative_altitude_m) < 0.3
    assert abs(seen["position_velocity_ned"].position.north_m) < 0.3
    assert abs(seen["velocity_ned"].north_m_s) < 0.2
    assert abs(seen["attitude_euler"].roll_deg) < 2.0
    assert abs(seen["attitude_angular_velocity_body"].roll_rad_s) < 0.1
    assert math.cos(math.radians(seen["heading"].heading_deg)) > 0.99
    assert (seen["gps_info"].num_satellites, seen["gps_info"].fix_type.name) == (18, "RTK_FIXED")
    assert seen["raw_gps"].latitude_deg == pytest.approx(47.397742, abs=1e-5)
    assert seen["battery"].voltage_v == pytest.approx(full_v, abs=0.3)
    assert (seen["in_air"], seen["armed"], seen["health_all_ok"]) == (False, False, True)
    assert (seen["landed_state"].name, seen["flight_mode"].name) == ("ON_GROUND", "HOLD")
    assert seen["fixedwing_metrics"].throttle_percentage == 0.0
    for name in ("scaled_imu", "raw_imu"):
        force = seen[name].acceleration_frd
        assert abs(force.forward_m_s2) < abs(force.down_m_s2)
    assert (await vehicle.telemetry.get_gps_global_origin()).altitude_m == pytest.approx(488)
    assert (await vehicle.info.get_version()).flight_sw_major == 4


async def rates(vehicle: Any) -> None:
    """Messages come as often as they were ordered, by the time of the vehicle."""
    for hz in (10.0, 2.5):
        await vehicle.telemetry.set_rate_scaled_imu(hz)
        times_s = [v.timestamp_us / 1e6 async for v in _some(vehicle.telemetry.scaled_imu(), 9)]
        gaps_s = [after - before for before, after in itertools.pairwise(times_s)]
        assert statistics.median(gaps_s) == pytest.approx(1.0 / hz, abs=0.002)
    await vehicle.telemetry.set_rate_position_velocity_ned(20.0)


async def _some(stream: AsyncIterator[Any], count: int) -> AsyncIterator[Any]:
    for _ in range(count):
        yield await asyncio.wait_for(anext(stream), PATIENCE_S)


async def parameters(vehicle: Any) -> None:
    await vehicle.param.set_param_float("FS_TIMEOUT", 6.0)
    assert await vehicle.param.get_param_float("FS_TIMEOUT") == 6.0
    await vehicle.param.set_param_int("FENCE_ACTION", 1)
    assert await vehicle.param.get_param_int("FENCE_ACTION") == 1
    everything = await vehicle.param.get_all_params()
    assert "WP_SPEED" in {p.name for p in everything.float_params}
    assert "FENCE_ACTION" in {p.name for p in everything.int_params}
    with pytest.raises(mavsdk.param.ParamError):
        await vehicle.param.get_param_float("SIM_GPS1_NOISE")


async def armed_with_a_text(vehicle: Any) -> None:
    """Nobody tells when a subscription has begun, so arm until a text has come through it."""
    texts = first(vehicle.telemetry.status_text(), lambda t: t.text == "Throttle armed")
    heard = asyncio.ensure_future(texts)
    while not heard.done():
        await vehicle.action.disarm()
        await vehicle.action.arm()
        await asyncio.wait({heard}, timeout=1.0)
    assert heard.result().text == "Throttle armed"


async def geofence(vehicle: Any) -> None:
    """A square to stay in and a circle to keep out of: up, down, cleared; and a rally point."""
    g = mavsdk.geofence
    home = await first(vehicle.telemetry.home())

    def point(north: float, east: float) -> Any:
        return g.Point(
            home.latitude_deg + north * NORTH_DEG, home.longitude_deg + east * NORTH_DEG * 1.48
        )

    corners = [point(*c) for c in ((-25, -25), (25, -25), (25, 25), (-25, 25))]
    square = g.Polygon(corners, g.FenceType.INCLUSION)
    circle = g.Circle(point(20, 20), 2.0, g.FenceType.EXCLUSION)
    await vehicle.geofence.upload_geofence(g.GeofenceData([square], [circle]))
    back = await vehicle.geofence.download_geofence()
    assert [len(p.points) for p in back.polygons] == [4]
    assert [(c.radius, c.fence_type.name) for c in back.circles] == [(2.0, "EXCLUSION")]
    await vehicle.geofence.clear_geofence()
    assert await vehicle.mission_raw.download_geofence() == []
    x, y = round(home.latitude_deg * 1e7), round(home.longitude_deg * 1e7)
    rally = mavsdk.mission_raw.MissionItem(0, 6, 5100, 0, 1, 0.0, 0.0, 0.0, 0.0, x, y, 5.0, 2)
    await vehicle.mission_raw.upload_rally_points([rally])
    (there,) = await vehicle.mission_raw.download_rallypoints()
    assert (there.x, there.y) == (x, y)


async def by_hand(vehicle: Any, axes: tuple[float, float, float, float], seen: Any) -> Any:
    """Hold a joystick (x, y, z, r) until `seen` comes true."""
    waiting = asyncio.ensure_future(seen)
    while not waiting.done():
        await vehicle.manual_control.set_manual_control_input(*axes)
        await asyncio.wait({waiting}, timeout=0.05)
    return waiting.result()


async def failures(vehicle: Any, ports: Ports) -> None:
    """On the station's port it does not exist; on the injector's it works, behind its gate."""
    unit, kind = mavsdk.failure.FailureUnit, mavsdk.failure.FailureType
    with pytest.raises(mavsdk.failure.FailureError, match="UNSUPPORTED"):
        await vehicle.failure.inject(unit.SYSTEM_MOTOR, kind.OFF, 1)
    async with connected(f"udpout://127.0.0.1:{ports.injector}") as injector:
        with pytest.raises(mavsdk.failure.FailureError, match="DENIED"):
            await injector.failure.inject(unit.SYSTEM_MOTOR, kind.OFF, 1)
        await injector.param.set_param_int("SYS_FAILURE_EN", 1)
        await injector.failure.inject(unit.SYSTEM_MOTOR, kind.OFF, 0)
        await injector.failure.inject(unit.SENSOR_GPS, kind.OFF, 0)
        await first(vehicle.telemetry.gps_info(), lambda g: g.fix_type.value <= 1)
        await injector.failure.inject(unit.SYSTEM_MOTOR, kind.OK, 0)
        await injector.failure.inject(unit.SENSOR_GPS, kind.OK, 0)
        await first(vehicle.telemetry.gps_info(), lambda g: g.fix_type.value > 1)


def set_mode(ports: Ports, number: int) -> None:
    """MAVSDK has no word for the modes of a person at the sticks; the station beside it has."""
    from_another_station(ports, Encoder(245, 190).set_mode(SYSID, number))


def troubles(records: list[Any]) -> list[tuple[str, str]]:
    """Warnings, errors and time-outs in what the client has logged."""
    told = [(r.levelname, r.getMessage()) for r in records]
    assert told, "the client's log is not heard"
    return [t for t in told if t[0] in ("WARNING", "ERROR") or "imeout" in t[1]]
