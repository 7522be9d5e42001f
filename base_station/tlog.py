"""Telemetry logs as ground stations write them: a time stamp and a raw MAVLink frame, repeated."""

import os
import struct
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

from hil.errors import InputError

FLUSH_EVERY_US = 1_000_000
_STAMP = struct.Struct(">Q")  # microseconds since 1970
_V1, _V2 = 0xFE, 0xFD
_V1_OVERHEAD, _V2_OVERHEAD, _SIGNATURE = 8, 12, 13  # bytes around the payload


class TlogWriter:
    """Both directions of one link in one file; what is older than 1 s is on disk."""

    def __init__(self, path: Path, append: bool = False) -> None:
        """`append` goes on with what there is, without a frame that was cut off."""
        if append and path.exists():
            whole = sum(_STAMP.size + len(frame) for _, frame in read_tlog(path))
            os.truncate(path, whole)
        self._file = path.open("ab" if append else "wb")
        self._flushed_us = 0

    def write(self, time_us: int, frame: bytes) -> None:
        """Add a frame, or a datagram of several (the format wants a stamp for each).

        Bytes that are no frame are left out: readers would lose step over them.
        """
        stamp = _STAMP.pack(time_us)
        for one in split(frame):
            self._file.write(stamp + one)
        if abs(time_us - self._flushed_us) >= FLUSH_EVERY_US:
            self._file.flush()
            self._flushed_us = time_us

    @property
    def size(self) -> int:
        """Bytes, those not flushed yet included."""
        return self._file.tell()

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def split(datagram: bytes) -> Iterator[bytes]:
    """The MAVLink 1 and 2 frames in a datagram; what is not one is skipped."""
    start = 0
    while start < len(datagram):
        length = _frame_length(datagram, start)
        if length is None or start + length > len(datagram):
            start += 1
            continue
        yield datagram[start : start + length]
        start += length


def read_tlog(path: Path) -> Iterator[tuple[int, bytes]]:
    """(microseconds, frame) in the order written; a tail cut off in the middle is left out.

    Raises InputError where the file is not a telemetry log.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; check the path") from None
    at = 0
    while at + _STAMP.size < len(data):
        frame = at + _STAMP.size
        if data[frame] not in (_V1, _V2):
            raise InputError(
                f"{path}: byte {frame} is 0x{data[frame]:02x}, no start of a MAVLink frame; "
                "is it a .tlog?"
            )
        length = _frame_length(data, frame)
        if length is None or frame + length > len(data):
            return
        yield _STAMP.unpack_from(data, at)[0], data[frame : frame + length]
        at = frame + length


def _frame_length(data: bytes, start: int) -> int | None:
    """Whole length of the frame that starts there; None where none does, or too little is left."""
    if start + 2 >= len(data):
        return None
    magic, payload, flags = data[start : start + 3]
    if magic == _V1:
        return _V1_OVERHEAD + payload
    if magic == _V2:
        return _V2_OVERHEAD + payload + (_SIGNATURE if flags & 1 else 0)
    return None
