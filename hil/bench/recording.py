"""The recording of a run: the truth beside what the station recorded, merged into one file."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

RERUN = (sys.executable, "-m", "rerun")
STATION_RECORDING, TRUTH_RECORDING, RECORDING = "station.rrd", "truth.rrd", "mission.rrd"
MERGE_WITHIN_S = 120.0


def merge_recordings(folder: Path) -> Path | None:
    """One mission.rrd out of the parts there are; None when there are none.

    The parts go once they are merged. One that was cut off by SIGKILL is taken as far as it reads.
    """
    parts = [p for p in (folder / STATION_RECORDING, folder / TRUTH_RECORDING) if _holds_data(p)]
    target = folder / RECORDING
    if not parts:
        return target if target.exists() else None
    if len(parts) > 1 and not _merged(parts, target):
        parts[0].replace(target)
        return target
    if len(parts) == 1:
        parts[0].replace(target)
        return target
    for part in parts:
        part.unlink()
    return target


def _holds_data(path: Path) -> bool:
    return path.exists() and path.stat().st_size > 0


def _merged(parts: Iterable[Path], target: Path) -> bool:
    command = [*RERUN, "rrd", "merge", "--continue-on-error", *map(str, parts), "-o", str(target)]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            timeout=MERGE_WITHIN_S,
            check=False,
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0 and _holds_data(target)
