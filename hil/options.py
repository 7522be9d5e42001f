"""Options on a command line: bad ones are reported as all other bad input is."""

import argparse
from typing import NoReturn

from hil.errors import InputError

MIN_SPEED, MAX_SPEED = 0.01, 1000.0


class Parser(argparse.ArgumentParser):
    """Raises InputError instead of printing its usage."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see `{self.prog} --help`")


def port(text: str) -> int:
    """A UDP port."""
    value = int(text)  # argparse words the ValueError
    if not 1 <= value <= 65535:
        raise argparse.ArgumentTypeError(f"{text}: a port is 1 to 65535")
    return value


def speed(text: str) -> float:
    """Times real time; 0 is as fast as possible."""
    value = float(text)
    if value != 0.0 and not MIN_SPEED <= value <= MAX_SPEED:
        limits = f"0, or {MIN_SPEED:g} to {MAX_SPEED:g}"
        raise argparse.ArgumentTypeError(f"{text}: must be {limits}")
    return value


def count(text: str) -> int:
    """At least one of something."""
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: must be 1 or more")
    return value


def times(text: str) -> int:
    """How often something may be repeated."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text}: must be 0 or more")
    return value


def minutes(text: str) -> float:
    """A stretch of wall time."""
    value = float(text)
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text}: must be more than 0")
    return value


LEAST_MB = 16.0


def megabytes(text: str) -> float:
    """Room on a disk; less than the least is no log worth having."""
    value = float(text)
    if not LEAST_MB <= value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text}: must be {LEAST_MB:g} or more")
    return value
