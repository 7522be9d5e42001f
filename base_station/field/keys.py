"""Where somebody sits at a terminal: the space bar stops everything, g gives vehicles back."""

import os
import termios
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from enum import Enum
from typing import TextIO

STOP, GIVE_BACK = b" ", b"g"


class Typed(Enum):
    """STOP: the stop key was pressed; GIVE_BACK: the key that gives back who was taken over.
    GONE: the terminal is no longer there."""

    NOTHING = "nothing"
    STOP = "stop"
    GIVE_BACK = "give_back"
    GONE = "gone"


class Keys:
    """`fd` None: there is no terminal."""

    def __init__(self, fd: int | None) -> None:
        self._fd = fd

    def filenos(self) -> tuple[int, ...]:
        """For `select`."""
        return () if self._fd is None else (self._fd,)

    def typed(self, ready: Sequence[int]) -> Typed:
        """What has come from the terminal since it was last asked, if it is `ready`."""
        if self._fd is None or self._fd not in ready:
            return Typed.NOTHING
        try:
            text = os.read(self._fd, 1024)
        except OSError:
            return Typed.GONE
        if not text:
            return Typed.GONE
        if STOP in text:
            return Typed.STOP
        return Typed.GIVE_BACK if GIVE_BACK in text else Typed.NOTHING


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
            with suppress(termios.error):  # the terminal may be gone
                termios.tcsetattr(fd, termios.TCSADRAIN, before)
