"""What a vehicle costs: one step without sockets, and the process at real time.

`python benchmarks/vehicle_step.py [--seconds 20]` prints one line for each.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

from hil.mavlink import Encoder
from hil.physics_link import AT_REST_MPS2, PhysicsState
from hil.scenario import load_scenario
from sim_vehicles.vehicle import Vehicle

SCENARIO = Path(__file__).parents[1] / "scenarios" / "healthy.yaml"
SYSID, AUTOPILOT_HZ, STEPS = 2, 50, 20_000
PORTS = {1: 0, 2: 10, 3: 20}
ZERO = (0.0, 0.0, 0.0)


def step_us(sends_setpoints: bool) -> float:
    """Microseconds of CPU a step of a driving vehicle, default streams included."""
    vehicle, station = Vehicle(load_scenario(SCENARIO), SYSID), Encoder(250, 190)
    spent_s = 0.0
    for tick in range(1, STEPS + 1):
        state = PhysicsState(tick / AUTOPILOT_HZ, ZERO, AT_REST_MPS2, ZERO, ZERO, ZERO)
        if tick == 100:
            vehicle.receive("gcs", station.arm(SYSID))
            vehicle.receive("gcs", station.set_mode(SYSID, 15))
        begin_s = time.process_time()
        if tick % AUTOPILOT_HZ == 0:
            vehicle.receive("gcs", station.gcs_heartbeat())
        if sends_setpoints and tick % 5 == 0:
            setpoint = station.velocity_setpoint(SYSID, tick * 20, 0.3, 0.1, None)
            vehicle.receive("gcs", setpoint)
        vehicle.step(state)
        vehicle.outbox("gcs"), vehicle.outbox("injector")
        spent_s += time.process_time() - begin_s
    return spent_s / STEPS * 1e6


def cpu_share(seconds: float, base: int) -> float:
    """Share of one core that a vehicle process takes at real time, world and fleet running."""
    world = ["hil.cli", "world", str(SCENARIO), "--physics-port", str(base)]
    commands = [world]
    for sysid, offset in PORTS.items():
        ports = ["--physics-port", base + offset, "--mavlink-port", base + 100 + offset]
        words = [*ports, "--injector-port", base + 200 + offset]
        commands.append(
            ["sim_vehicles.process", str(SCENARIO), "--sysid", str(sysid), *map(str, words)]
        )
    processes = []
    try:
        for words in commands:
            process = subprocess.Popen(
                [sys.executable, "-m", *words], stdout=subprocess.PIPE, text=True
            )
            processes.append(process)
            assert process.stdout is not None
            process.stdout.readline()
        time.sleep(3.0)
        before_s, begin_s = _cpu_s(processes[1].pid), time.monotonic()
        time.sleep(seconds)
        return (_cpu_s(processes[1].pid) - before_s) / (time.monotonic() - begin_s)
    finally:
        for process in processes:
            process.terminate()
            process.communicate()


def _cpu_s(pid: int) -> float:
    """User and system time of a process so far (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--base-port", type=int, default=21000)
    arguments = parser.parse_args()
    for name, sends in (("default streams", False), ("and set-points at 10 Hz", True)):
        cost_us = step_us(sends)
        limit = 1e6 / cost_us / AUTOPILOT_HZ
        print(f"step, {name}: {cost_us:.0f} us; at most {limit:.0f} x real time on one core")
    print(
        f"process at real time: {cpu_share(arguments.seconds, arguments.base_port):.1%} of a core"
    )


if __name__ == "__main__":
    main()
