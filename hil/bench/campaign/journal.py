"""The journal of a campaign: finished runs, one JSON line each, on disk before the next is taken.

A line is written whole or torn at the end; a torn last line is cut off when the journal is opened
again, and its run is done again. So a kill at any moment neither loses nor repeats a finished run.
"""

import fcntl
import json
import os
from pathlib import Path
from types import TracebackType

from hil.bench.campaign.row import Row
from hil.errors import InputError

JOURNAL_FILE = "runs.jsonl"


class Journal:
    """`rows` by key: all that had finished before. Only one process may hold a journal."""

    def __init__(self, folder: Path) -> None:
        path = folder / JOURNAL_FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._file = path.open("a+b")
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}; choose another --out") from None
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._file.close()
            raise InputError(
                f"{path}: another campaign writes here; wait for it, or choose another --out"
            ) from None
        self.rows = {row.key: row for row in self._read(path)}

    def add(self, row: Row) -> None:
        """On disk when this returns."""
        self.rows[row.key] = row
        self._file.write(json.dumps(row.tree()).encode() + b"\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self,
        _type: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self._file.close()

    def _read(self, path: Path) -> list[Row]:
        self._file.seek(0)
        raw = self._file.read()
        whole = raw.rfind(b"\n") + 1
        if whole < len(raw):
            self._file.truncate(whole)
        rows = []
        for number, line in enumerate(raw[:whole].splitlines(), start=1):
            try:
                rows.append(Row.of_tree(json.loads(line)))
            except (ValueError, TypeError, KeyError):
                self._file.close()
                raise InputError(
                    f"{path}: line {number} is no run of this version; choose another --out"
                ) from None
        return rows
