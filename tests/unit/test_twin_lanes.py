"""Columns as values, against numpy."""

import numpy as np
import pytest
from numba import njit

from base_station.twin.lanes import (
    LANES,
    anywhere,
    least,
    lengthened,
    magnitude,
    most,
    put,
    root,
    shortened,
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


DOUBLES, SINGLES = (np.float64, 1e-14), (np.float32, 1e-6)  # number, and its rounding


@pytest.mark.parametrize(
    ("shape", "kind"), [((2, 6, LANES), DOUBLES), ((2, 6, LANES), SINGLES), ((2, 6), DOUBLES)]
)
def test_every_operation_is_that_of_numpy(shape, kind):
    array = np.random.default_rng(0).uniform(-1.0, 1.0, shape).astype(kind[0])
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
    assert array[1] == pytest.approx(np.array(expected), rel=kind[1], abs=0.1 * kind[1])
    assert found == (False, bool((x >= 2.0).any()), False)


@njit
def sum_of_both(doubles, singles):
    put(doubles, 0, 1, take(doubles, 0, 0) + lengthened(take(singles, 0, 0)))
    put(singles, 0, 1, shortened(take(doubles, 0, 0)) + take(singles, 0, 0))


@pytest.mark.parametrize("lanes", [(LANES,), ()])
def test_singles_and_doubles_meet_only_when_told_to(lanes):
    doubles, singles = np.full((1, 2, *lanes), 1.0 + 2.0**-40), np.ones((1, 2, *lanes), np.float32)
    if not lanes:  # of a single world all is double
        singles = singles.astype(np.float64)
    sum_of_both(doubles, singles)
    assert (doubles[0, 1] == 2.0 + 2.0**-40).all()
    assert (singles[0, 1] == (2.0 if lanes else 2.0 + 2.0**-40)).all()
