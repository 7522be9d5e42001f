"""Planner messages survive the way through a pipe."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from base_station.belief.hypotheses import Hypothesis
from base_station.planning.requests import (
    OpenLoopPlan,
    PlanProgress,
    PlanReady,
    PlanRequest,
    PolicyWeights,
    Training,
    decode,
    encode,
)
from hil.faults import Fault, Type, Unit

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
KINDS = st.sampled_from(["alpha", "beta"])
FAULTS = st.one_of(
    st.none(),
    st.builds(
        Fault,
        st.sampled_from([Unit.MOTOR, Unit.GPS]),
        st.sampled_from([Type.OFF, Type.STUCK]),
        st.lists(st.integers(1, 8), max_size=3).map(tuple),
        st.lists(st.sampled_from(["north", "east"]), max_size=2).map(tuple),
        st.lists(NUMBERS, max_size=3).map(tuple),
    ),
)
HYPOTHESES = st.builds(Hypothesis, st.text(max_size=8), st.integers(1, 249), NUMBERS, FAULTS)


def arrays(*shape: int):
    size = int(np.prod(shape))
    entry = st.one_of(NUMBERS, st.just(float("nan")))
    return st.lists(entry, min_size=size, max_size=size).map(lambda x: np.reshape(x, shape))


REQUESTS = st.builds(
    PlanRequest,
    st.integers(0, 99),
    KINDS,
    st.integers(0, 2**31),
    st.sampled_from(["tuned", "paper"]),
    st.lists(HYPOTHESES, min_size=2, max_size=2).map(tuple),
    st.tuples(NUMBERS, NUMBERS),
    arrays(2, 1, 3),
    st.tuples(st.booleans()),
)
TRAININGS = st.builds(
    Training,
    st.text(max_size=5),
    st.text(max_size=5),
    st.integers(0, 9),
    st.booleans(),
    st.integers(0, 10**6),
    NUMBERS,
    st.lists(st.tuples(NUMBERS, NUMBERS), max_size=3).map(tuple),
)
PLANS = st.builds(
    OpenLoopPlan,
    arrays(2, 1, 3),
    NUMBERS,
    st.lists(st.integers(0, 9), max_size=2).map(tuple),
    NUMBERS,
    arrays(2, 3, 1, 2),
)
POLICIES = st.builds(
    PolicyWeights, st.tuples(st.tuples(arrays(2, 3), arrays(2)), st.tuples(arrays(1, 2), arrays(1)))
)
READIES = st.builds(
    PlanReady,
    st.integers(0, 99),
    KINDS,
    st.lists(TRAININGS, max_size=2).map(tuple),
    st.one_of(st.none(), PLANS),
    st.one_of(st.none(), POLICIES),
    st.one_of(st.none(), arrays(3, 2, 2)),
)
PROGRESSES = st.builds(
    PlanProgress,
    st.integers(0, 99),
    KINDS,
    st.integers(0, 9),
    st.integers(0, 10**6),
    st.integers(0, 10**6),
    NUMBERS,
)


@given(st.one_of(REQUESTS, READIES, PROGRESSES))
def test_a_message_comes_back_as_it_was(message):
    line = encode(message)
    assert "\n" not in line
    back = decode(line)
    assert type(back) is type(message)
    assert encode(back) == line
    assert repr(back) == repr(message)


@pytest.mark.parametrize("line", ["{}", "[]", '{"type": "Hypothesis"}', "no JSON", "3"])
def test_anything_else_is_refused(line):
    with pytest.raises(ValueError, match=r"planner message|Expecting value"):
        decode(line)


def test_numbers_of_numpy_are_plain_on_the_way():
    message = PlanProgress(1, "alpha", 0, np.int64(5), 9, np.float64(0.5))
    assert json.loads(encode(message))["timesteps"] == 5
