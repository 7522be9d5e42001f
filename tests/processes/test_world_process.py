"""`hil world` over real sockets, with vehicles that only speak the physics link."""

import json
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from children import HIL, ROOT, Child, child
from fake_vehicle import FakeVehicle
from free_ports import free_ports

from hil.scenario import FaultModel
from hil.world.lockstep import SILENT_AFTER_S
from hil.world.orders import Break, Mend, order_line

SCENARIO = str(ROOT / "scenarios" / "rescue.yaml")
FORWARD = (1900, 1900, 1500, 1500)


@pytest.fixture
def base() -> int:
    return free_ports(3, step=10)[0]


@pytest.fixture
def vehicles(base: int) -> Iterator[list[FakeVehicle]]:
    fleet = [FakeVehicle(base + 10 * i, FORWARD) for i in range(3)]
    yield fleet
    for vehicle in fleet:
        vehicle.__exit__()


def world(base: int, *options: str) -> tuple[str, ...]:
    return (*HIL, "world", SCENARIO, "--physics-port", str(base), *options)


def step_all(vehicles: list[FakeVehicle]) -> float:
    for vehicle in vehicles:
        vehicle.send()
    return min([vehicle.receive().time_s for vehicle in vehicles])


def drive(vehicles: list[FakeVehicle], until_s: float) -> None:
    while step_all(vehicles) < until_s - 1e-9:
        pass


def stop(process: Child) -> None:
    process.signal(signal.SIGTERM)
    assert process.wait() == 0
    assert process.stderr() == ""


def test_vehicles_drive_and_the_truth_is_written(
    base: int, vehicles: list[FakeVehicle], tmp_path: Path
) -> None:
    truth = tmp_path / "truth.jsonl"
    with child(*world(base, "--speed", "0", "--truth", str(truth))) as process:
        process.wait_for("ready")
        drive(vehicles, until_s=1.0)
        stop(process)
    lines = [json.loads(line) for line in truth.read_text().splitlines()]
    assert [line["time_s"] for line in lines[:11]] == [i / 10 for i in range(11)]
    assert lines[-1]["vehicles"]["1"][0] > 0.4


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_stops_cleanly_before_anyone_joined(base: int, number: signal.Signals) -> None:
    with child(*world(base, "--truth", "-")) as process:
        process.wait_for("ready")
        process.signal(number)
        process.wait_for('{"type":"truth"')
        assert process.wait() == 0


def test_the_leash_holds_time_zero_and_every_limit_after(
    base: int, vehicles: list[FakeVehicle]
) -> None:
    with child(*world(base, "--speed", "0", "--leash", "--truth", "-")) as process:
        process.wait_for("ready")
        for vehicle in vehicles:
            vehicle.send()
        process.write("until 0.1")
        assert [v.receive().time_s for v in vehicles] == [0.02] * 3
        drive(vehicles, until_s=0.1)
        for vehicle in vehicles:
            vehicle.send()  # not answered before the leash is longer
        process.wait_for('{"type":"truth","time_s":0.1,')
        process.write("until 0.2")
        assert [v.receive().time_s for v in vehicles] == pytest.approx([0.12] * 3)
        process.close_stdin()
        assert process.wait() == 0


def test_a_silent_vehicle_is_named_and_ends_a_leashed_world(
    base: int, vehicles: list[FakeVehicle]
) -> None:
    with child(*world(base, "--speed", "0", "--leash")) as process:
        process.wait_for("ready")
        process.write("until 100")
        step_all(vehicles)
        for vehicle in vehicles[1:]:
            vehicle.send()
        assert process.wait() == 3
    assert "rover_1 (sysid 1" in process.stderr()
    assert "Traceback" not in process.stderr()


def test_by_hand_the_world_goes_on_without_a_silent_vehicle(
    base: int, vehicles: list[FakeVehicle]
) -> None:
    with child(*world(base, "--speed", "0")) as process:
        process.wait_for("ready")
        step_all(vehicles)
        others = vehicles[1:]
        step_all(others)  # answered once rover_1 has been given up
        drive(others, until_s=1.0)
        process.signal(signal.SIGTERM)
        assert process.wait() == 0
    assert f"rover_1 (sysid 1, port {base}) has been silent" in process.stderr()
    assert SILENT_AFTER_S == 2.0


def test_a_busy_port_is_named(base: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", base + 10))
        with child(*world(base)) as process:
            assert process.wait() == 2
    assert str(base + 10) in process.stderr()
    assert process.stderr().count("\n") == 1


def test_faults_come_over_the_leash_and_end_there(base: int, vehicles: list[FakeVehicle]) -> None:
    """Rover 1 without power does not move; with it again it does, the others all the time."""
    fault = FaultModel(vehicle=1, unit="motor", type="off", applied_by="world")
    with child(*world(base, "--speed", "0", "--leash", "--truth", "-")) as process:
        process.wait_for("ready")
        process.write(order_line(Break(fault)))
        process.write("until 1")
        drive(vehicles, until_s=1.0)
        first = json.loads(process.wait_for('{"type":"truth","time_s":1.0,'))["vehicles"]
        process.write(order_line(Mend(fault)))
        process.write("until 2")
        drive(vehicles, until_s=2.0)
        second = json.loads(process.wait_for('{"type":"truth","time_s":2.0,'))["vehicles"]
        process.close_stdin()
        assert process.wait() == 0
    assert first["1"][3] == 0.0
    assert first["2"][3] > 0.3
    assert second["1"][3] > 0.3


def test_an_order_that_cannot_be_is_named(base: int) -> None:
    with child(*world(base, "--leash")) as process:
        process.wait_for("ready")
        process.write('break {"vehicle": 1, "unit": "gps", "type": "off", "applied_by": "world"}')
        assert process.wait() == 2
    assert "the world can't apply gps off" in process.stderr()
