"""How the kernel's functions are compiled: cached on disk, and fit for vector registers.

A multiplication and the addition that follows may become one rounding instead of two (`contract`);
apart from that, IEEE arithmetic in the written order: the same inputs give the same bits.
"""

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])

ARITHMETIC = {"error_model": "numpy", "fastmath": {"contract"}}


def compiled(function: F) -> F:
    """Compiled as a part of whatever calls it; not cached by itself."""
    result: F = njit(**ARITHMETIC)(function)
    return result


def inlined(function: F) -> F:
    """As if written where it is called: there, the sizes of arrays are constants, and a loop over
    lanes becomes vector instructions. For the inner loops only: it takes the compiler long."""
    result: F = njit(inline="always", **ARITHMETIC)(function)
    return result


def cached(function: F) -> F:
    """Compiled with all that it calls, once per machine and version of the sources.

    numba looks for changes in the function's own file only, but at the values that it closes over,
    too: so it must close over `sources()`, or an old kernel would survive a new `contact.py`.
    """
    result: F = njit(cache=True, **ARITHMETIC)(function)
    return result


def sources() -> int:
    """A checksum of all files of this package."""
    checksum = 1
    for path in sorted(Path(__file__).parent.glob("*.py")):
        checksum = zlib.crc32(path.read_bytes(), checksum)
    return checksum
