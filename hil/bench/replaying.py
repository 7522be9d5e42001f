"""`hil replay`: recorded telemetry through the station's eyes again, and what it would say now."""

import json
from collections.abc import Sequence
from pathlib import Path

from base_station.records import Event
from base_station.replay import DECISIONS, differences, replay
from base_station.tlog import read_tlog
from hil.bench.folders import VIEW_FILE
from hil.bench.runlog import EVENTS_FILE
from hil.errors import EXIT_AS_EXPECTED, EXIT_NOT_AS_EXPECTED, InputError
from hil.scenario import load_station_view


def replay_run(paths: Sequence[Path], view_file: Path | None) -> int:
    """Replay a run's folder, or telemetry logs with a view; 0 when all decisions are the same.

    Raises InputError for logs or views that can't be read.
    """
    folder = paths[0] if len(paths) == 1 and paths[0].is_dir() else None
    logs = sorted(folder.glob("*.tlog")) if folder else list(paths)
    if not logs:
        raise InputError(f"{folder}: no .tlog there; name the folder of a run, or .tlog files")
    if view_file is None and folder is None:
        raise InputError("--view: needed with .tlog files; see `hil station-view`")
    view = load_station_view(view_file or paths[0] / VIEW_FILE)
    now = replay(view, [frame for log in logs for frame in read_tlog(log)])
    for event in now:
        print(f"{event.time_s:8.1f} s  {event.kind:<10}  {event.text}")
    if not now:
        print("nothing stands out: no anomaly, no verdict")
    then = read_decisions(folder / EVENTS_FILE) if folder else None
    if then is None:
        return EXIT_AS_EXPECTED
    different = differences(then, now)
    print(f"{len(different) or 'no'} decision{'' if len(different) == 1 else 's'} would differ")
    for difference in different:
        print(f"  {difference.text}")
    return EXIT_NOT_AS_EXPECTED if different else EXIT_AS_EXPECTED


def read_decisions(events_file: Path) -> tuple[Event, ...] | None:
    """What was decided then; None when that is not known."""
    if not events_file.exists():
        return None
    with events_file.open(encoding="utf-8") as lines:
        trees = [json.loads(line) for line in lines]
    return tuple(Event(**tree) for tree in trees if tree["kind"] in DECISIONS)
