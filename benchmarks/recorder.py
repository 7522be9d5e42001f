"""What recording costs: processor, disk, and what a SIGKILL takes with it.

    python benchmarks/recorder.py [--vehicles 10] [--seconds 60]

Invented telemetry with noise, at real time, for the station's part and the truth's; a third of the
time five twins are in doubt. Prints a table in Markdown.
"""

import argparse
import math
import multiprocessing
import os
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from base_station.recorder import Recorder
from base_station.recording.merge import merge
from base_station.recording.reading import Recording
from base_station.recording.truth import TruthRecorder
from base_station.records import Snapshot, TwinSnapshot, VehicleSnapshot
from hil.scenario import Scenario, StationView, load_scenario, station_view

RESCUE = Path(__file__).parents[1] / "scenarios" / "rescue.yaml"
TWINS = ("motor_x_off", "motor_y_off", "gps_north_stuck", "gps_east_stuck", "none")
HZ = 10.0
KILL_AFTER_S = 10.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicles", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    share, running_mb, merged_mb = cost(options.vehicles, options.seconds)
    _, running_once_mb, once_mb = cost(options.vehicles, 1.0 / HZ)
    minutes = options.seconds / 60.0
    print(f"| {options.vehicles} vehicles at real time | measured |\n|---|---|")
    print(f"| processor, of one core | {100 * share:.1f} % |")
    print(f"| file while it runs | {(running_mb - running_once_mb) / minutes:.2f} MB a minute |")
    print(f"| file of {options.seconds:g} s afterwards, all in all | {merged_mb:.2f} MB |")
    print(f"| of that, layout and looks | {once_mb:.2f} MB |")
    print(f"| lost by a SIGKILL | {lost_s(options.vehicles):.2f} s |")


def cost(vehicles: int, seconds: float) -> tuple[float, float, float]:
    """Share of a core, MB of both parts, MB of the merged recording."""
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name:
        folder, told = Path(name), spawn.Queue()
        process = spawn.Process(target=record, args=(folder, vehicles, seconds, told))
        process.start()
        share = told.get()
        process.join()
        parts = [folder / "station.rrd", folder / "truth.rrd"]
        merge(parts, folder / "mission.rrd")
        megabytes = [p.stat().st_size / 1e6 for p in (*parts, folder / "mission.rrd")]
    return share, megabytes[0] + megabytes[1], megabytes[2]


def record(
    folder: Path, vehicles: int, seconds: float, told: "multiprocessing.Queue[float]"
) -> None:
    """Both parts of a recording at real time; tells its share of a core, telemetry not counted."""
    scenario, view = fleet(vehicles)
    station = Recorder(folder / "station.rrd", "cost", view)
    truth = TruthRecorder(folder / "truth.rrd", "cost", scenario)
    poses = {v.sysid: (v.start.north_m, v.start.east_m, 0.0) for v in scenario.fleet}
    started_s, begun_s, invented_s = time.monotonic(), time.process_time(), 0.0
    story = snapshots(view, seconds)
    while True:
        before_s = time.process_time()
        snapshot = next(story, None)
        invented_s += time.process_time() - before_s
        if snapshot is None:
            break
        time.sleep(max(0.0, started_s + snapshot.time_s - time.monotonic()))
        station.snapshot(snapshot)
        truth.truth(
            snapshot.time_s, poses | {v.sysid: (*v.reported_m, 0.0) for v in snapshot.vehicles}
        )
    station.close()
    truth.close()
    told.put((time.process_time() - begun_s - invented_s) / seconds)


def lost_s(vehicles: int) -> float:
    """How much older than its death the last row of a killed recorder is."""
    spawn = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as name:
        told = spawn.Queue()
        process = spawn.Process(target=record, args=(Path(name), vehicles, 60.0, told))
        process.start()
        file = Path(name) / "station.rrd"
        while not file.exists():
            time.sleep(0.01)
        time.sleep(KILL_AFTER_S)
        killed_s = time.time()
        os.kill(process.pid or 0, signal.SIGKILL)
        process.join()
        return killed_s - float(Recording(file).scalars("/residual/north", "wall_time").times[-1])


def fleet(vehicles: int) -> tuple[Scenario, StationView]:
    """The rescue with more rovers, far apart."""
    rescue = load_scenario(RESCUE, [])
    first = rescue.fleet[0]
    rovers = [
        first.model_copy(update={"sysid": k + 1, "name": f"rover_{k + 1}"}) for k in range(vehicles)
    ]
    scenario = rescue.model_copy(update={"fleet": tuple(rovers)})
    return scenario, station_view(scenario, mavlink_port_base=14550, station_seed=1)


def snapshots(view: StationView, seconds: float) -> Iterator[Snapshot]:
    """Everybody drives about; noise on all that a sensor reports."""
    random = np.random.default_rng(0)
    count = len(view.fleet)
    suspect = np.eye(count, 2)[:, :1] * np.ones(2)
    for tick in range(round(seconds * HZ)):
        time_s = tick / HZ
        turn = 0.3 * time_s + np.arange(count)
        place = np.stack([np.cos(turn), np.sin(turn)], axis=1) + 3.0 * np.arange(count)[:, None]
        reported = place + random.normal(0.0, 0.02, place.shape)
        vehicles = tuple(
            VehicleSnapshot(
                sysid=m.sysid,
                name=m.name,
                phase="mission",
                reported_m=tuple(reported[k]),
                velocity_mps=tuple(random.normal(0.3, 0.05, 2)),
                yaw_rad=float(turn[k] % math.pi),
                setpoint_mps=(0.3 * math.cos(tick // 2 + k), 0.3 * math.sin(tick // 2 + k)),
                motor_outputs=tuple(random.normal(0.5, 0.1, 4).round(2)),
                battery_percent=90.0,
                gps_satellites=14,
                residual=tuple(random.normal(0.0, 1.0, 2)),
                cusum=tuple(np.abs(random.normal(0.0, 1.0, 2))),
            )
            for k, m in enumerate(view.fleet)
        )
        names = TWINS if seconds / 3 <= time_s < 2 * seconds / 3 else TWINS[-1:]
        twins = tuple(
            TwinSnapshot(
                hypothesis=name,
                posterior=1.0 / len(names),
                log_likelihood=float(random.normal()),
                true_m=place + 0.01 * k,
                report_m=place + 0.01 * k + suspect * 0.1 * k,
                sigma_m=0.05 * suspect,
                yaw_rad=turn,
            )
            for k, name in enumerate(names)
        )
        yield Snapshot(time_s, "mission", 4.5, vehicles, twins)


if __name__ == "__main__":
    main()
