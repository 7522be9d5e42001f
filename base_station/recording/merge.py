"""Parts of a recording to one file."""

import logging
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from base_station.recording.binary import rerun

TIMEOUT_S = 120.0

log = logging.getLogger(__name__)


def merge(parts: Sequence[Path], out: Path) -> None:
    """One compact recording of `parts`; one that was cut off loses only its end.

    Should that fail altogether, `out` is the largest part as it is, and a warning says so. Parts
    that are missing or empty are left out; with none left, FileNotFoundError.
    """
    there = [part for part in parts if part.is_file() and part.stat().st_size]
    if not there:
        raise FileNotFoundError(f"none of {', '.join(map(str, parts))} holds a recording")
    for verb in ("optimize", "merge"):
        profile = ["--profile", "live"] if verb == "optimize" else []
        if _rrd(verb, *profile, "--continue-on-error", "-o", str(out), *map(str, there)):
            return
    largest = max(there, key=lambda part: part.stat().st_size)
    log.warning("could not merge the recording: %s is a copy of %s alone", out, largest.name)
    shutil.copyfile(largest, out)


def _rrd(*arguments: str) -> bool:
    command = rerun("rrd", *arguments)
    try:
        done = subprocess.run(command, capture_output=True, timeout=TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return False
    if done.returncode:
        log.debug("%s: %s", " ".join(arguments[:1]), done.stderr.decode(errors="replace"))
    return done.returncode == 0
