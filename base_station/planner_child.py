"""The planner as a child process: requests down its stdin, progress and plans up its stdout."""

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest, decode, encode
from hil.errors import ProcessDiedError
from hil.lifeline import dying_with_parent

STOP_S = 3.0
RESTARTS = 3  # then something is wrong that starting again does not mend
PROGRAM = (sys.executable, "-m", "base_station.planning.process")


class PlannerChild:
    """Never blocks: requests are one small write, answers are read as they come.

    A planner that a signal has ended (killed, out of memory) is started again, and asked again what
    it had not answered.
    """

    def __init__(self, view_path: Path, log_path: Path, program: Sequence[str] = PROGRAM) -> None:
        self._command, self._log_path = [*program, str(view_path)], log_path
        self._asked: PlanRequest | None = None
        self._restarts = 0
        self._start("wb")

    def _start(self, log_mode: str) -> None:
        environment = {**os.environ, "OMP_NUM_THREADS": "1"}
        with self._log_path.open(log_mode) as log:
            self._child = subprocess.Popen(
                self._command,
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
        """One that is gone is noticed by `poll`, and asked then."""
        self._asked = request
        with suppress(BrokenPipeError):
            self._to.write(encode(request).encode() + b"\n")
            self._to.flush()

    def poll(self) -> list[PlanProgress | PlanReady]:
        """Raises ProcessDiedError when the planner has given up, or was ended too often."""
        data = self._from.read()
        *lines, self._rest = (self._rest + (data or b"")).split(b"\n")
        told = [decode(line.decode()) for line in lines if line.startswith(b"{")]
        messages = [m for m in told if isinstance(m, PlanProgress | PlanReady)]
        if self._asked and any(
            isinstance(m, PlanReady) and m.number == self._asked.number for m in messages
        ):
            self._asked = None
        if data == b"" or self._child.poll() is not None:
            self._start_again()
        return messages

    def _start_again(self) -> None:
        code = self._child.wait()
        if code >= 0 or self._restarts == RESTARTS:
            raise ProcessDiedError(f"planner died (exit code {code})")
        self._restarts += 1
        how = signal.Signals(-code).name
        print(f"planner was killed by {how}: started again", file=sys.stderr, flush=True)
        self._close_pipes()
        self._start("ab")
        if self._asked is not None:
            self.submit(self._asked)

    def close(self) -> None:
        self._child.terminate()
        try:
            self._child.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._child.kill()
            self._child.wait()
        self._close_pipes()

    def _close_pipes(self) -> None:
        with suppress(BrokenPipeError):  # what it was sent in half
            self._to.close()
        self._from.close()
