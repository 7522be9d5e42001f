"""MAVSDK against a vehicle in the real world process: connect, arm, drive, stop."""

import asyncio
import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from rover_process import PATIENCE_S, SCENARIO, free_port

mavsdk = pytest.importorskip("mavsdk_grpc")
pytestmark = pytest.mark.filterwarnings("ignore")  # the client's own are not ours to judge


@pytest.fixture
def mavlink_port() -> Iterator[int]:
    """The MAVLink port of rover 2, with world and fleet running."""
    physics, mavlink, injector = (base_port() for _ in range(3))
    commands = [["hil.cli", "world", "--physics-port", str(physics)]]
    for i in range(3):
        ports = ["--physics-port", physics, "--mavlink-port", mavlink, "--injector-port", injector]
        words = [str(w + 10 * i) if isinstance(w, int) else w for w in ports]
        commands.append(["sim_vehicles.process", "--sysid", str(i + 1), *words])
    with ExitStack() as stack:
        for module, *options in commands:
            argv = [sys.executable, "-m", module, *options]
            argv.insert(4 if module == "hil.cli" else 3, str(SCENARIO))
            process = subprocess.Popen(argv, stdout=subprocess.PIPE, text=True)
            stack.callback(process.communicate)
            stack.callback(process.kill)
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        yield mavlink + 10


def base_port() -> int:
    """A free port with room above it for two more vehicles."""
    return next(port for port in iter(free_port, None) if port < 65000)


async def first(stream: AsyncIterator[Any], wanted: Callable[[Any], bool]) -> Any:
    async def search() -> Any:
        async for value in stream:
            if wanted(value):
                return value
        raise AssertionError("the stream ended")

    return await asyncio.wait_for(search(), PATIENCE_S)


async def drive(port: int) -> None:
    rover = mavsdk.System()
    await rover.connect(f"udpin://127.0.0.1:{port}")
    await first(rover.core.connection_state(), lambda state: state.is_connected)
    await first(rover.telemetry.health(), lambda h: h.is_local_position_ok and h.is_armable)
    assert (await rover.info.get_version()).flight_sw_major == 4
    await rover.param.set_param_float("FS_TIMEOUT", 6.0)
    assert await rover.param.get_param_float("FS_TIMEOUT") == 6.0
    await rover.action.arm()
    await rover.offboard.set_velocity_ned(mavsdk.offboard.VelocityNedYaw(0.5, 0.0, 0.0, 0.0))
    await rover.offboard.start()
    await first(rover.telemetry.position_velocity_ned(), lambda p: p.position.north_m > 0.5)
    await rover.offboard.stop()
    await rover.action.hold()
    await rover.action.disarm()
    await first(rover.telemetry.armed(), lambda armed: not armed)


def test_mavsdk_drives_a_rover(mavlink_port: int) -> None:
    asyncio.run(drive(mavlink_port))
