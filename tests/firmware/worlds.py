"""Foreign firmware in our world, started for a test and killed after it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import yaml

from hil.bench.firmware import start_of
from hil.bench.folders import pin_ports
from hil.bench.ports import choose_ports
from hil.lifeline import dying_with_parent
from hil.scenario import Scenario

SPEED = "4"


@contextmanager
def firmware_world(scenario: Scenario, folder: Path) -> Iterator[Scenario]:
    """The scenario as it runs: its ports are pinned, its world and its autopilots are there."""
    scenario = pin_ports(scenario, choose_ports(scenario))
    file = folder / "scenario.yaml"
    file.write_text(yaml.safe_dump(scenario.model_dump(mode="json", exclude_none=True)))
    argv = (sys.executable, "-m", "hil.cli", "world", str(file), "--speed", SPEED)
    world = subprocess.Popen(argv, stdout=subprocess.PIPE, preexec_fn=dying_with_parent())
    processes = [world]
    try:
        assert world.stdout is not None
        assert world.stdout.readline() == b"ready\n"
        for vehicle in scenario.fleet:
            start = start_of(vehicle.autopilot)
            assert start is not None
            command = start(scenario, vehicle, folder)
            with command.log.open("wb") as log:
                processes.append(
                    subprocess.Popen(
                        command.argv,
                        cwd=command.cwd,
                        stdout=log,
                        stderr=subprocess.STDOUT,
                        preexec_fn=dying_with_parent(),
                    )
                )
        yield scenario
    finally:
        for process in processes:
            process.kill()
            process.wait()
        if world.stdout is not None:
            world.stdout.close()
