"""How the kernel's functions are compiled: IEEE arithmetic in the written order, cached on disk."""

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """Compiled as a part of whatever calls it; not cached by itself."""
    result: F = njit(error_model="numpy")(function)
    return result


def cached(function: F) -> F:
    """Compiled with all that it calls, once per machine and version of the sources.

    numba looks for changes in the function's own file only, but at the values that it closes over,
    too: so it must close over `sources()`, or an old kernel would survive a new `contact.py`.
    """
    result: F = njit(cache=True, error_model="numpy")(function)
    return result


def sources() -> int:
    """A checksum of all files of this package."""
    checksum = 1
    for path in sorted(Path(__file__).parent.glob("*.py")):
        checksum = zlib.crc32(path.read_bytes(), checksum)
    return checksum
