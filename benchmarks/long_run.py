"""Hours in memory: does memory stay flat, and how do the files grow?

    python benchmarks/long_run.py [--hours 8] [--every 10] [--scenario healthy]

World, vehicles and station in one process, with journal, logs and recording as in a run. The fleet
is driven all the time, one pulse of the probe after the other. Each `--every` simulated minutes a
line: resident memory and the size of each kind of file. Exit code 1 when memory after the first
half hour grew by more than 5 %.
"""

import argparse
import os
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from base_station import execution
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.journal import Head, Journal
from base_station.listeners import open_listeners
from base_station.phases import Probing
from base_station.receiving.telemetry import Frame
from hil.bench.folders import blind_view
from hil.bench.rig import Rig
from hil.scenario import load_scenario

ROOT = Path(__file__).parents[1]
SETTLED_S = 1800.0
GROWTH = 0.05


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=8.0)
    parser.add_argument("--every", type=float, default=10.0, metavar="MINUTES")
    parser.add_argument("--scenario", default="healthy")
    arguments = parser.parse_args()
    scenario = load_scenario(ROOT / "scenarios" / f"{arguments.scenario}.yaml")
    view = blind_view(scenario)
    pulses = execution.probe_pulses(len(view.fleet))
    period_s = len(pulses) * (view.limits.probe_pulse_s + execution.SETTLE_S)

    def decide(desk: Desk, frame: Frame) -> Orders:
        assert isinstance(desk.phase, Probing)
        elapsed_s = (frame.time_s - desk.phase.since_s) % period_s
        pulse, driven = execution.pulse_at(pulses, elapsed_s, view)
        if pulse is None or not driven:
            return desk.hold()
        return execution.pulse_orders(pulse, float(frame.yaw_rad[pulse.vehicle]), view)

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        journal = Journal(folder, Head(view.model_dump(mode="json")))
        stack.callback(journal.close)
        listeners = open_listeners(stack, folder, "long", view, None, lambda _line: None)
        rig = Rig(scenario, view, listeners, journal=journal)
        rig.node.station._decide = decide  # no plan, no end: the fleet is probed for ever
        return _watched(rig, folder, arguments.hours * 3600.0, arguments.every * 60.0)


def _watched(rig: Rig, folder: Path, end_s: float, every_s: float) -> int:
    began_s, next_s = time.monotonic(), every_s
    settled_mb = most_mb = 0.0
    for _ in rig.run():
        if rig.time_s < next_s:
            continue
        next_s += every_s
        mb = _resident_mb()
        if rig.time_s <= SETTLED_S:
            settled_mb = mb
        most_mb = max(most_mb, mb)
        print(f"{rig.time_s / 60:6.0f} min  {mb:7.1f} MB  {_sizes(folder)}", flush=True)
        if rig.time_s >= end_s:
            break
    wall_s = time.monotonic() - began_s
    growth = most_mb / settled_mb - 1.0 if settled_mb else float("nan")
    print(f"growth after the first half hour: {growth:+.1%}; {rig.time_s / wall_s:.1f} x real time")
    return 1 if growth > GROWTH else 0


def _resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _sizes(folder: Path) -> str:
    sizes: dict[str, int] = {}
    for path in folder.iterdir():
        sizes[path.suffix] = sizes.get(path.suffix, 0) + path.stat().st_size
    return ", ".join(f"{kind} {size / 1e6:.1f} MB" for kind, size in sorted(sizes.items()))


if __name__ == "__main__":
    sys.exit(main())
