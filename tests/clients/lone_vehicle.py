"""A world with one vehicle in it, as processes; and how to watch what clients say."""

import queue
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from free_ports import free_ports

PATIENCE_S = 30.0
SYSID = 2
LONE = """
name: lone
yaw: {yaw}
arena: {{north_min_m: -30.0, north_max_m: 30.0, east_min_m: -30.0, east_max_m: 30.0}}
fleet:
  - name: vehicle
    sysid: {sysid}
    airframe: {airframe}
    start: {{north_m: 0.0, east_m: 0.0}}
    goal: {{north_m: 1.0, east_m: 0.0}}
"""


@dataclass(frozen=True)
class Ports:
    """UDP: where the vehicle speaks to, where other stations find it, and the injector's."""

    mavlink: int
    listen: int
    injector: int


@contextmanager
def lone_vehicle(
    folder: Path, airframe: str = "omni_plus", speed: float = 1.0, options: tuple[str, ...] = ()
) -> Iterator[Ports]:
    """`options` are for the vehicle's command line."""
    yaw = "free" if airframe == "skid_steer" else "locked"  # it has to turn
    scenario = folder / "lone.yaml"
    scenario.write_text(LONE.format(sysid=SYSID, airframe=airframe, yaw=yaw))
    physics, *others = free_ports(4)
    ports = Ports(*others)
    world = ["hil.cli", "world", str(scenario), "--physics-port", str(physics)]
    vehicle = ["sim_vehicles.process", str(scenario), "--sysid", str(SYSID)]
    vehicle += ["--physics-port", str(physics), "--mavlink-port", str(ports.mavlink)]
    vehicle += ["--listen-port", str(ports.listen), "--injector-port", str(ports.injector)]
    vehicle += options
    with ExitStack() as stack:
        processes = [
            subprocess.Popen([sys.executable, "-m", *words], stdout=subprocess.PIPE, text=True)
            for words in ([*world, "--speed", str(speed)], vehicle)
        ]
        for process in processes:
            stack.callback(process.communicate)
            stack.callback(process.kill)
        for process in processes:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
        yield ports


class Console:
    """A client with a prompt: what it is told, and what it says, line by line."""

    def __init__(self, command: list[str], folder: Path) -> None:
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
            cwd=folder,
        )
        self.said: list[str] = []
        self._lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.rstrip())

    def tell(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def expect(self, pattern: str, again: str | None = None) -> str:
        """Wait for a line that the pattern is found in; `again` is told each half second."""
        end_s = time.monotonic() + PATIENCE_S
        tell_s = time.monotonic() if again else end_s
        while (now_s := time.monotonic()) < end_s:
            if again is not None and now_s >= tell_s:
                self.tell(again)
                tell_s = now_s + 0.5
            try:
                line = self._lines.get(timeout=max(0.01, min(end_s, tell_s) - now_s))
            except queue.Empty:
                continue
            self.said.append(line)
            if re.search(pattern, line):
                return line
        raise AssertionError(f"no {pattern!r} after:\n" + "\n".join(self.said))

    def stop(self) -> None:
        self.process.kill()
        self.process.communicate()
        while not self._lines.empty():
            self.said.append(self._lines.get())
