"""Columns as values, against numpy."""

import numpy as np
import pytest
from numba import njit

from base_station.twin.lanes import (
    LANES,
    anywhere,
    least,
    magnitude,
    most,
    put,
    root,
    signed,
    take,
    where,
)


@njit
def every_operation(array):
    x, y = take(array, 0, 0), take(array, 0, 1)
    put(array, 1, 0, x + 2.0 * y - x * y)
    put(array, 1, 1, 1.0 / y - (-x))
    put(array, 1, 2, root(magnitude(x)))
    put(array, 1, 3, most(x, 0.1) + least(y, x))
    put(array, 1, 4, where(x <= y, x, 7.0))
    put(array, 1, 5, where(x > 0.0, signed(3.0, y), y))
    return anywhere(x > 2.0), anywhere(x >= 2.0), anywhere(y < -5.0)


@pytest.mark.parametrize("shape", [(2, 6, LANES), (2, 6)])
def test_every_operation_is_that_of_numpy(shape):
    array = np.random.default_rng(0).uniform(-1.0, 1.0, shape)
    if len(shape) == 3:
        array[0, 0, -1] = 2.0  # in one lane only
    x, y = array[0, 0].copy(), array[0, 1].copy()
    found = every_operation(array)
    expected = [
        x + 2.0 * y - x * y,
        1.0 / y + x,
        np.sqrt(np.abs(x)),
        np.maximum(x, 0.1) + np.minimum(y, x),
        np.where(x <= y, x, 7.0),
        np.where(x > 0.0, np.copysign(3.0, y), y),
    ]
    assert array[1] == pytest.approx(np.array(expected), rel=1e-14, abs=1e-15)
    assert found == (False, bool((x >= 2.0).any()), False)
