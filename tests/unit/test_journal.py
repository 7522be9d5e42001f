"""The journal's records: a round trip, and whatever may happen to a file's end."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from base_station.journal import (
    Head,
    Inputs,
    Journal,
    Record,
    Said,
    Sent,
    decoded,
    encoded,
    journal_files,
    read_journal,
)
from base_station.planning.requests import PlanReady, PolicyWeights, Training
from hil.errors import InputError

HEAD = Head({"host": "127.0.0.1"}, resumed=True, signed=True)
ANSWER = PlanReady(
    3,
    "beta",
    (Training("ppo", "tuned", 0, True, 10, 0.5, ((1.0, 2.0),)),),
    policy=PolicyWeights(((np.ones((2, 3)), np.zeros(2)),)),
)
DATAGRAMS = st.lists(st.tuples(st.integers(0, 99), st.binary(max_size=300)), max_size=5).map(tuple)
STEPS = st.builds(
    Inputs, st.floats(0, 1e9), st.integers(0, 2**63), DATAGRAMS, st.just(()), st.booleans()
) | st.builds(Sent, DATAGRAMS)


def same(a: Sequence[Record], b: Sequence[Record]) -> bool:
    return [encoded(x) for x in a] == [encoded(x) for x in b]


@given(st.lists(STEPS, max_size=6))
def test_round_trip(records: list[Record]) -> None:
    assert list(decoded(b"".join(map(encoded, records)))) == records


def test_round_trip_of_a_plan_and_an_event() -> None:
    inputs = Inputs(1.0, 2, ((0, b"abc"),), (ANSWER, replace(ANSWER, number=4)))
    said = Said({"time_s": 1.0, "kind": "text", "text": "x", "data": {"sysid": 2}})
    records = [HEAD, inputs, said]
    back = list(decoded(b"".join(map(encoded, records))))
    assert same(back, records)
    assert isinstance(back[1], Inputs)
    assert back[1].answers[1].number == 4


@given(st.lists(STEPS, min_size=1, max_size=4), st.data())
def test_a_torn_or_damaged_end_is_left_out(records: list[Record], data: st.DataObject) -> None:
    frames = [encoded(r) for r in records]
    whole, last = b"".join(frames[:-1]), frames[-1]
    cut = data.draw(st.integers(0, len(last) - 1))
    assert list(decoded(whole + last[:cut])) == records[:-1]
    bit = data.draw(st.integers(0, 8 * len(last) - 1))
    flipped = bytearray(last)
    flipped[bit // 8] ^= 1 << bit % 8
    assert list(decoded(whole + bytes(flipped))) == records[:-1]


@given(st.binary(max_size=400))
def test_noise_is_no_journal(noise: bytes) -> None:
    assert all(isinstance(record, Head | Inputs | Sent | Said) for record in decoded(noise))


def test_every_process_writes_a_file_of_its_own(tmp_path: Path) -> None:
    first = Journal(tmp_path, replace(HEAD, resumed=False))
    first.inputs(Inputs(1.0, 1))
    # killed: it is not closed, and its last record is torn
    with first.path.open("ab") as file:
        file.write(encoded(Inputs(2.0, 2))[:-3])
    second = Journal(tmp_path, HEAD)
    second.outputs(((0, b"x"),), ())
    second.close()
    second.close()
    first.close()
    names = [path.name for path in sorted(tmp_path.iterdir())]
    assert names == ["journal-0001.bin", "journal-0002.bin"]
    records = list(read_journal(tmp_path))
    expected = [replace(HEAD, resumed=False), Inputs(1.0, 1), HEAD, Sent(((0, b"x"),))]
    assert records == expected


def test_no_journal_and_one_of_another_version(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing to resume"):
        list(read_journal(tmp_path))
    (tmp_path / "journal-0001.bin").write_bytes(encoded(replace(HEAD, format=99)))
    with pytest.raises(InputError, match="version"):
        list(read_journal(tmp_path))
    (tmp_path / "journal-0001.bin").write_bytes(b"")
    assert list(read_journal(tmp_path)) == []


def test_a_journal_that_begins_anew_holds_what_came_after_and_nothing_else(tmp_path: Path) -> None:
    journal = Journal(tmp_path, HEAD, long_bytes=1000)
    steps = [Inputs(float(k), k, ((0, bytes(100)),)) for k in range(20)]
    for step in steps[:10]:
        assert not journal.is_long or step.epoch_us >= 7
        journal.inputs(step)
    assert journal.is_long
    journal.begin_anew()
    assert not journal.is_long
    for step in steps[10:]:
        journal.inputs(step)
    journal.close()
    assert list(read_journal(tmp_path)) == [replace(HEAD, resumed=False), *steps[10:]]
    assert [path.name for path in journal_files(tmp_path)] == ["journal-0002.bin"]
