"""How the kernel's functions are compiled: cached on disk, IEEE arithmetic in the written order."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    result: F = njit(cache=True, error_model="numpy")(function)
    return result
