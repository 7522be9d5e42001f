"""Renews the stored log of a rescue, for `tests/unit/test_replay.py`.

    hil run scenarios/rescue.yaml --in-memory --out RUN
    python tests/data/keep_rescue.py RUN

Due when the station is meant to decide otherwise than the stored log tells; a test that fails
without such an intention has found a bug. Keeps the telemetry of all links until a second after
the verdict, what was decided until then, and what the station was told of the fleet.
"""

import lzma
import shutil
import struct
import sys
from pathlib import Path

from base_station.replay import DECISIONS
from base_station.tlog import read_tlog

HERE = Path(__file__).parent
AFTER_S = 1.0


def main(run: Path) -> None:
    """Raises ValueError for a run without a verdict."""
    events = (run / "station-events.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    told = [line for line in events if any(f'"kind": "{k}"' in line for k in DECISIONS)]
    if not told or '"kind": "verdict"' not in told[-1]:
        raise ValueError(f"{run}: not one verdict, at the end")
    verdict_s = float(told[-1].split('"time_s": ')[1].split(",")[0])
    frames = sorted(
        (stamped for log in run.glob("*.tlog") for stamped in read_tlog(log)), key=lambda f: f[0]
    )
    until_us = frames[0][0] + (verdict_s + AFTER_S) * 1e6
    kept = [struct.pack(">Q", time_us) + frame for time_us, frame in frames if time_us <= until_us]
    packed = lzma.compress(b"".join(kept), preset=9 | lzma.PRESET_EXTREME)
    (HERE / "rescue.tlog.xz").write_bytes(packed)
    (HERE / "rescue-events.jsonl").write_text("".join(told), encoding="utf-8")
    shutil.copyfile(run / "view.json", HERE / "rescue-view.json")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
