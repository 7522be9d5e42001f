"""Logs in parts, so that a long outing fills no disk: a new part begins when one is full.

Parts are `station.rrd`, `station-2.rrd`, ...; whoever reads a folder takes them all. With a limit,
the oldest that nobody writes into any more are deleted. The journal and events.jsonl have no parts:
a station is resumed from the one, and the other is small.
"""

import os
from dataclasses import dataclass
from pathlib import Path

PART_BYTES = 64_000_000
KINDS = ("*.tlog", "station*.rrd")


@dataclass(frozen=True)
class Room:
    """How long a part may get, and all parts together (bytes; None: as long as it takes)."""

    part_bytes: int = PART_BYTES
    total_bytes: int | None = None

    @classmethod
    def of_megabytes(cls, total_mb: float | None) -> "Room":
        """With a limit to all of them, a part is at most a sixteenth of it."""
        if total_mb is None:
            return cls()
        total_bytes = int(total_mb * 1e6)
        return cls(min(PART_BYTES, total_bytes // 16), total_bytes)

    def make(self, folder: Path) -> None:
        """Delete the oldest parts until there is room for one more. Raises OSError.

        A log's newest part stays, whatever that comes to.
        """
        if self.total_bytes is None:
            return
        logs: dict[str, list[Path]] = {}
        for kind in KINDS:
            for path in folder.glob(kind):
                logs.setdefault(_log_of(path), []).append(path)
        sizes = {p: p.stat().st_size for parts in logs.values() for p in parts}
        newest = {max(parts, key=_number) for parts in logs.values()}
        old = sorted(sizes.keys() - newest, key=lambda p: p.stat().st_mtime_ns)
        too_much = sum(sizes.values()) + self.part_bytes - self.total_bytes
        for path in old:
            if too_much <= 0:
                return
            os.unlink(path)
            too_much -= sizes[path]


def next_part(first: Path) -> Path:
    """The path of the part after the last there is; `first` where there is none."""
    parts = parts_of(first)
    if not parts:
        return first
    return first.with_stem(f"{first.stem}-{_number(parts[-1]) + 1}")


def parts_of(first: Path) -> list[Path]:
    """All that there are, in the order in which they were written."""
    others = first.parent.glob(f"{first.stem}-[0-9]*{first.suffix}")
    return sorted((p for p in (first, *others) if p.exists()), key=_number)


def _log_of(path: Path) -> str:
    stem, _, number = path.stem.partition("-")
    return f"{stem}{path.suffix}" if number.isdigit() or not number else path.name


def _number(path: Path) -> int:
    number = path.stem.rpartition("-")[2]
    return int(number) if number.isdigit() else 1
