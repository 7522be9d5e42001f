"""The planner as a child process: requests down its stdin, progress and plans up its stdout."""

import os
import subprocess
import sys
from pathlib import Path
from typing import IO

from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest, decode, encode
from hil.errors import ProcessDiedError
from hil.lifeline import dying_with_parent

STOP_S = 3.0


class PlannerChild:
    """Never blocks: requests are one small write, answers are read as they come."""

    def __init__(self, view_path: Path, log_path: Path) -> None:
        command = [sys.executable, "-m", "base_station.planning.process", str(view_path)]
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        with log_path.open("wb") as log:
            self._child = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=environment,
                preexec_fn=dying_with_parent(),
            )
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        self._to: IO[bytes] = self._child.stdin
        self._from: IO[bytes] = self._child.stdout
        os.set_blocking(self._from.fileno(), False)
        self._rest = b""

    @property
    def pid(self) -> int:
        return self._child.pid

    def fileno(self) -> int:
        """For `select`."""
        return self._from.fileno()

    def submit(self, request: PlanRequest) -> None:
        """Raises ProcessDiedError when the planner is gone."""
        try:
            self._to.write(encode(request).encode() + b"\n")
            self._to.flush()
        except BrokenPipeError:
            raise ProcessDiedError(f"planner died (exit code {self._child.poll()})") from None

    def poll(self) -> list[PlanProgress | PlanReady]:
        """Raises ProcessDiedError when the planner is gone."""
        data = self._from.read()
        if data == b"" or self._child.poll() is not None:
            raise ProcessDiedError(f"planner died (exit code {self._child.wait()})")
        *lines, self._rest = (self._rest + (data or b"")).split(b"\n")
        messages = [decode(line.decode()) for line in lines if line.startswith(b"{")]
        return [m for m in messages if isinstance(m, PlanProgress | PlanReady)]

    def close(self) -> None:
        self._child.terminate()
        try:
            self._child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._to.close()
        self._from.close()
