"""One key stops everything: the space bar, where somebody sits at a terminal."""

import os
import termios
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TextIO

STOP = b" "


class Keys:
    """`fd` None: there is no terminal."""

    def __init__(self, fd: int | None) -> None:
        self._fd = fd

    def filenos(self) -> tuple[int, ...]:
        """For `select`."""
        return () if self._fd is None else (self._fd,)

    def pressed(self, ready: Sequence[int]) -> bool:
        """Whether the stop key is among what was typed; a terminal that is gone counts, too."""
        if self._fd is None or self._fd not in ready:
            return False
        try:
            typed = os.read(self._fd, 1024)
        except OSError:
            return True
        return not typed or STOP in typed


@contextmanager
def emergency_key(stdin: TextIO) -> Iterator[Keys]:
    """Keys come one by one and are not echoed, until it is left."""
    fd = stdin.fileno() if stdin.isatty() else None
    before = None if fd is None else termios.tcgetattr(fd)
    if fd is not None:
        tty.setcbreak(fd)
    try:
        yield Keys(fd)
    finally:
        if fd is not None and before is not None:
            termios.tcsetattr(fd, termios.TCSADRAIN, before)
