"""Child processes: started, listened to, watched, and stopped without leaving an orphan."""

import json
import os
import selectors
import signal
import subprocess
import time
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path

from hil.errors import HilError, ProcessDiedError
from hil.lifeline import dying_with_parent

STOP_WITHIN_S = 3.0
SHELL_TRACES = ("PWD", "OLDPWD", "_")


@dataclass(frozen=True)
class Command:
    """A process to start; its stderr goes to `log`.

    `again` is how it is started again should a signal end it; without, that ends the run.
    """

    name: str
    argv: tuple[str, ...]
    log: Path
    cwd: Path | None = None
    takes_lines: bool = False
    again: tuple[str, ...] | None = None
    says_ready: bool = True  # somebody else's program does not


def _environment() -> dict[str, str]:
    """Ours without the traces of a shell: where that was may name the scenario to the station."""
    return {name: value for name, value in os.environ.items() if name not in SHELL_TRACES}


class Child:
    """One running process in a group of its own."""

    def __init__(self, command: Command) -> None:
        self.name, self.log, self._command = command.name, command.log, command
        self.may_end = False
        self._start(command.argv, "wb")

    @property
    def may_start_again(self) -> bool:
        """A signal ended it, and it knows how to go on."""
        return self._command.again is not None and (self.process.poll() or 0) < 0

    def start_again(self) -> None:
        """In the same place; what it said in half is lost."""
        assert self._command.again is not None
        self.signal_group(signal.SIGKILL)
        self.close()
        self._start(self._command.again, "ab")

    def _start(self, argv: tuple[str, ...], log_mode: str) -> None:
        self.ready = not self._command.says_ready
        self._rest = b""
        with self.log.open(log_mode) as log:
            self.process = subprocess.Popen(
                argv,
                cwd=self._command.cwd,
                stdin=subprocess.PIPE if self._command.takes_lines else subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                bufsize=0,
                env=_environment(),
                start_new_session=True,
                preexec_fn=dying_with_parent(),
            )
        assert self.process.stdout is not None
        self.stdout = self.process.stdout
        os.set_blocking(self.stdout.fileno(), False)

    def send(self, line: str) -> None:
        """To its stdin; one that has died is noticed elsewhere."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(line.encode() + b"\n")

    def read(self) -> tuple[list[str], bool]:
        """The whole lines that have come, and whether more may come."""
        more = True
        while True:
            data = self.stdout.read(1 << 16)
            if not data:
                more = data is None
                break
            self._rest += data
        *lines, self._rest = self._rest.split(b"\n")
        return [line.decode(errors="replace") for line in lines], more

    def death(self) -> str | None:
        """How it ended, in words with its last line of stderr; None while it lives."""
        code = self.process.poll()
        if code is None:
            return None
        if code < 0:
            how = f"was killed by {signal.Signals(-code).name}"
        else:
            how = f"ended with exit code {code}"
        words = self.log.read_text(errors="replace").split("\n") if self.log.exists() else []
        last = next((w.strip() for w in reversed(words) if w.strip()), "")
        return f"{self.name} {how}{f': {last}' if last else ''} (see {self.log.name})"

    def signal_group(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, number)

    def close(self) -> None:
        self.stdout.close()
        if self.process.stdin is not None:
            with suppress(BrokenPipeError):
                self.process.stdin.close()


class Children:
    """All processes of a run. `on_line(name, line)` gets what they say; leaving stops them."""

    def __init__(self, on_line: Callable[[str, str], None]) -> None:
        self._on_line = on_line
        self._children: list[Child] = []
        self._selector = selectors.DefaultSelector()
        self._stopping = False

    def __enter__(self) -> "Children":
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self, command: Command) -> Child:
        """Raises ProcessDiedError when it can't even be started."""
        try:
            child = Child(command)
        except OSError as error:
            raise ProcessDiedError(f"{command.name} cannot be started: {error}") from None
        self._children.append(child)
        self._selector.register(child.stdout, selectors.EVENT_READ, child)
        return child

    def _start_again(self, child: Child) -> None:
        if child.stdout in self._selector.get_map():
            self._selector.unregister(child.stdout)
        child.start_again()
        self._selector.register(child.stdout, selectors.EVENT_READ, child)

    def pump(self, timeout_s: float) -> None:
        """Hear what the children say. Raises ProcessDiedError when one has died."""
        for key, _ in self._selector.select(timeout_s):
            self._hear(key.data)
        for child in self._children:
            death = child.death()
            if death is None or child.may_end:
                continue
            self._hear(child)
            if child.may_end:  # its last line may have been its farewell
                continue
            if not child.may_start_again:
                raise ProcessDiedError(death)
            self._start_again(child)

    def wait_ready(self, within_s: float) -> None:
        """Until all have said `ready`. Raises ProcessDiedError naming who has not."""
        deadline_s = time.monotonic() + within_s
        while late := [c.name for c in self._children if not c.ready]:
            if time.monotonic() > deadline_s:
                raise ProcessDiedError(f"{', '.join(late)} not ready within {within_s:.0f} s")
            self.pump(0.1)

    def wait_end(self, child: Child, within_s: float) -> None:
        """Give a child time to end by itself; whatever happens it is stopped later."""
        child.may_end = True
        deadline_s = time.monotonic() + within_s
        while child.death() is None and time.monotonic() < deadline_s:
            self.pump(0.05)

    def stop(self) -> None:
        """SIGTERM, SIGKILL after 3 s, and SIGKILL for whatever they have started themselves."""
        self._stopping = True
        for child in self._children:
            child.may_end = True
            if child.process.poll() is None:
                child.process.terminate()
        deadline_s = time.monotonic() + STOP_WITHIN_S
        while self._anyone_alive() and time.monotonic() < deadline_s:
            self.pump(0.05)
        for child in self._children:
            child.signal_group(signal.SIGKILL)
            child.process.wait()
            self._hear(child)
            child.close()
        self._selector.close()
        self._children.clear()

    def _anyone_alive(self) -> bool:
        return any(c.process.poll() is None for c in self._children)

    def _hear(self, child: Child) -> None:
        if child.stdout.closed:
            return
        lines, more = child.read()
        if not more and child.stdout in self._selector.get_map():
            self._selector.unregister(child.stdout)
        for line in lines:
            child.ready = child.ready or _is_ready(line)
            with suppress(HilError) if self._stopping else nullcontext():
                self._on_line(child.name, line)


def _is_ready(line: str) -> bool:
    if line == "ready":
        return True
    if not line.startswith("{"):
        return False
    with suppress(ValueError):
        return bool(json.loads(line).get("type") == "ready")
    return False
