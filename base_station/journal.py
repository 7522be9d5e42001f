"""The station's journal: its inputs step by step, what it sent, and what it said.

The station is a state machine, so its inputs are its memory: a station that was killed replays
them (`resuming.py`) and believes again what it believed. What was sent and said is there to be
looked at, and to check the replay by.

A journal is a folder's `journal-0001.bin`, `journal-0002.bin`, ...: records that are only ever
appended, each `<length u32, CRC-32 u32, kind u8>` and its payload. A process begins a file of its
own, and one that was killed leaves at worst a torn last record, at which reading of its file ends.

A record is handed to the kernel before the step that it is about is carried out: the death of the
process loses nothing. A thread asks for the disk once a second (fdatasync), so that the death of
the machine loses about one second, and no step ever waits for a disk.

A station that only waits for its vehicles knows nothing worth keeping: when its journal has become
long, both begin anew.
"""

import json
import os
import struct
import threading
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from base_station.planning.requests import PlanReady, decode, encode
from base_station.records import Event
from hil.errors import InputError

SYNC_S = 1.0
LONG_BYTES = 64_000_000
FORMAT = 1
MAX_RECORD = 1 << 26  # a longer one is not ours
_RECORD = struct.Struct("<IIB")
_STEP = struct.Struct("<dQHH")
_DATAGRAM = struct.Struct("<HI")
_ANSWER = struct.Struct("<I")
_HEAD, _STEPPED, _SENT, _SAID, _GIVEN_BACK = 1, 2, 3, 4, 5

Datagrams = tuple[tuple[int, bytes], ...]


@dataclass(frozen=True)
class Inputs:
    """All that one step of the station depends on.

    `wall_s` and `epoch_us` are its clocks, `datagrams` (fleet index, bytes) those that said
    something, `answers` those of the planner; `given_back` whether a person has given back, before
    it, the vehicles that had been taken over.
    """

    wall_s: float
    epoch_us: int
    datagrams: Datagrams = ()
    answers: tuple[PlanReady, ...] = ()
    given_back: bool = False


@dataclass(frozen=True)
class Head:
    """How a file of the journal begins: the station's view as JSON, and after which one it goes on.

    `resumed` says whether a new process wrote it, after a gap. `signed` whether the links were.
    """

    view: dict[str, Any]
    resumed: bool = False
    signed: bool = False
    format: int = FORMAT


@dataclass(frozen=True)
class Sent:
    """What one step sent."""

    datagrams: Datagrams


@dataclass(frozen=True)
class Said:
    """An event of the step before."""

    event: dict[str, Any]


Record = Head | Inputs | Sent | Said


def event_tree(event: Event) -> dict[str, Any]:
    """An event as plain JSON values; there is no wall time in it."""
    return {"time_s": event.time_s, "kind": event.kind, "text": event.text, "data": event.data}


def encoded(record: Record) -> bytes:
    """One whole record, with its frame."""
    match record:
        case Head():
            kind, payload = _HEAD, json.dumps(vars(record)).encode()
        case Inputs():
            answers = [encode(answer).encode() for answer in record.answers]
            parts = [
                _STEP.pack(record.wall_s, record.epoch_us, len(record.datagrams), len(answers)),
                _packed(record.datagrams),
                *(_ANSWER.pack(len(a)) + a for a in answers),
            ]
            kind = _GIVEN_BACK if record.given_back else _STEPPED
            payload = b"".join(parts)
        case Sent():
            kind, payload = _SENT, _packed(record.datagrams)
        case Said():
            kind, payload = _SAID, json.dumps(record.event).encode()
    return _RECORD.pack(len(payload), zlib.crc32(payload, kind), kind) + payload


def decoded(data: bytes) -> Iterator[Record]:
    """The records of one file, up to its end or to the first that is torn or damaged."""
    at = 0
    while at + _RECORD.size <= len(data):
        length, checksum, kind = _RECORD.unpack_from(data, at)
        at += _RECORD.size
        payload = data[at : at + length]
        if len(payload) < length or length > MAX_RECORD or zlib.crc32(payload, kind) != checksum:
            return
        try:
            yield _record(kind, payload)
        except (ValueError, TypeError, KeyError, struct.error):
            return
        at += length


def journal_files(folder: Path) -> list[Path]:
    """In the order in which they were written."""
    return sorted(folder.glob("journal-*.bin"))


def read_journal(folder: Path) -> Iterator[Record]:
    """All records of a folder. Raises InputError where there is no journal of this format."""
    files = journal_files(folder)
    if not files:
        raise InputError(f"{folder}: holds no journal (journal-0001.bin); nothing to resume")
    for path in files:
        try:
            records = decoded(path.read_bytes())
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}; check the path") from None
        head = next(records, None)
        if head is None:
            continue  # killed before it had written anything
        if not isinstance(head, Head) or head.format != FORMAT:
            raise InputError(f"{path}: is no journal of this version of the station")
        yield head
        yield from records


class Journal:
    """Appends records to a new file of a folder. Every method raises OSError, as on a full disk."""

    def __init__(self, folder: Path, head: Head, long_bytes: int = LONG_BYTES) -> None:
        self._folder, self._head, self._long_bytes = folder, head, long_bytes
        self._bytes = 0
        self._file = self._new_file()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._sync, daemon=True, name="journal")
        self.write(head)
        self._thread.start()

    def write(self, *records: Record) -> None:
        """In one piece, so that a full disk tears at most the last."""
        data = b"".join(map(encoded, records))
        self._bytes += len(data)
        while data:
            data = data[os.write(self._file, data) :]

    def inputs(self, inputs: Inputs) -> None:
        """Before the step."""
        self.write(inputs)

    def outputs(self, sent: Datagrams, events: Sequence[Event]) -> None:
        """After the step, before anything is sent."""
        said = [Said(event_tree(event)) for event in events]
        if sent or said:
            self.write(Sent(sent), *said)

    @property
    def is_long(self) -> bool:
        """Whether one that only waits should begin anew."""
        return self._bytes >= self._long_bytes

    def begin_anew(self) -> None:
        """Forget all that was written: what comes from here on is a fresh station's."""
        old, fresh = journal_files(self._folder), self._new_file()
        os.dup2(fresh, self._file)  # under the thread's hands
        os.close(fresh)
        self._bytes = 0
        self.write(replace(self._head, resumed=False))
        for path in old:
            path.unlink()

    def _new_file(self) -> int:
        files = journal_files(self._folder)
        last = int(files[-1].stem.rpartition("-")[2]) if files else 0
        self.path = self._folder / f"journal-{last + 1:04d}.bin"
        return os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o600)

    def close(self) -> None:
        """Everything is on the disk afterwards, if it takes it. May be called twice."""
        if self._closing.is_set():
            return
        self._closing.set()
        self._thread.join()
        os.close(self._file)

    def _sync(self) -> None:
        ending = False
        while not ending:
            ending = self._closing.wait(SYNC_S)
            try:
                os.fdatasync(self._file)
            except OSError:
                return  # a disk in trouble refuses the next write, too, which is heard


def _packed(datagrams: Iterable[tuple[int, bytes]]) -> bytes:
    return b"".join(_DATAGRAM.pack(index, len(d)) + d for index, d in datagrams)


def _record(kind: int, payload: bytes) -> Record:
    if kind == _HEAD:
        return Head(**json.loads(payload))
    if kind == _SAID:
        return Said(json.loads(payload))
    if kind == _SENT:
        return Sent(tuple(_datagrams(payload, 0, None)[0]))
    if kind not in (_STEPPED, _GIVEN_BACK):
        raise ValueError(f"record of kind {kind}")
    wall_s, epoch_us, count, answers = _STEP.unpack_from(payload)
    datagrams, at = _datagrams(payload, _STEP.size, count)
    ready = []
    for _ in range(answers):
        (length,) = _ANSWER.unpack_from(payload, at)
        at += _ANSWER.size
        answer = decode(payload[at : at + length].decode())
        if not isinstance(answer, PlanReady):
            raise ValueError("an answer that is no plan")
        ready.append(answer)
        at += length
    return Inputs(wall_s, epoch_us, tuple(datagrams), tuple(ready), kind == _GIVEN_BACK)


def _datagrams(data: bytes, at: int, count: int | None) -> tuple[list[tuple[int, bytes]], int]:
    found: list[tuple[int, bytes]] = []
    while at < len(data) if count is None else len(found) < count:
        index, length = _DATAGRAM.unpack_from(data, at)
        at += _DATAGRAM.size
        if at + length > len(data):
            raise ValueError("a datagram that is longer than its record")
        found.append((index, data[at : at + length]))
        at += length
    return found, at
