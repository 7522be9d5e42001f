"""Helpers for tests with real processes: no sleeps, lines are waited for."""

import contextlib
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
LINE_WITHIN_S = 60.0
HIL = (sys.executable, "-m", "hil.cli")


class Child:
    """A process whose stdout lines can be waited for."""

    def __init__(self, *argv: str, cwd: Path = ROOT) -> None:
        self.process = subprocess.Popen(
            argv,
            cwd=cwd,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._errors: list[str] = []
        self._threads = [
            threading.Thread(target=self._read_stdout, daemon=True),
            threading.Thread(target=self._read_stderr, daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def wait_for(self, start: str) -> str:
        """The next line that starts so; fails when the process ends or stalls before."""
        while (line := self._lines.get(timeout=LINE_WITHIN_S)) is not None:
            if line.startswith(start):
                return line
        raise AssertionError(f"ended without a line {start!r}: {self.stderr()}")

    def write(self, line: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def close_stdin(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()

    def wait(self, within_s: float = LINE_WITHIN_S) -> int:
        code = self.process.wait(timeout=within_s)
        for thread in self._threads:
            thread.join()
        return code

    def signal(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def stderr(self) -> str:
        return "".join(self._errors)

    def _read_stdout(self) -> None:
        assert self.process.stdout is not None
        with self.process.stdout as stdout:
            for line in stdout:
                self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def _read_stderr(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as stderr:
            self._errors.extend(stderr)


@contextlib.contextmanager
def child(*argv: str, cwd: Path = ROOT) -> Iterator[Child]:
    """Start a process; it is gone when the block ends."""
    started = Child(*argv, cwd=cwd)
    try:
        yield started
    finally:
        started.process.kill()
        started.wait()
        with contextlib.suppress(OSError):
            started.close_stdin()
