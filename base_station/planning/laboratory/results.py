"""Results on disk, a line each: what is there is not done again (a study may take days)."""

import json
import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from base_station.planning.laboratory.jobs import Job
from hil.errors import InputError

Row = dict[str, Any]
LOG = logging.getLogger("reproduce")


@dataclass(frozen=True)
class Results:
    """The file of a reproduction. A last line that was cut off by a crash is dropped."""

    path: Path

    def read(self) -> dict[str, Row]:
        """Rows by the key of their job. Raises InputError when the file is something else."""
        if not self.path.exists():
            return {}
        lines = self.path.read_text(encoding="utf-8").split("\n")
        rows: dict[str, Row] = {}
        for number, line in enumerate(lines, start=1):
            try:
                if line:
                    row = json.loads(line)
                    rows[row["key"]] = row
            except (ValueError, KeyError, TypeError):
                if number == len(lines):
                    LOG.warning("%s: its last line is cut off; that job is done again", self.path)
                    self.path.write_text("\n".join([*lines[:-1], ""]), encoding="utf-8")
                    break
                raise InputError(
                    f"{self.path}, line {number}: not a result; move the file away to start anew"
                ) from None
        return rows

    def add(self, job: Job, row: Row) -> None:
        """Append a row; a reader never sees half of one but after a crash."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps({"key": job.key, **row}) + "\n")
