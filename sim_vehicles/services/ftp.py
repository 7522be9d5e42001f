"""FILE_TRANSFER_PROTOCOL, refused: without a NAK clients wait for a time-out at each connect."""

from struct import Struct

from hil.mavlink import FileTransfer
from sim_vehicles.services.service import Handlers, Replies, Request

# sequence, session, opcode, size, requested opcode, burst complete, padding, offset
_HEADER = Struct("<HBBBBBBI")
NAK = 129
FILE_NOT_FOUND, UNKNOWN_COMMAND = 10, 7
_ON_A_PATH = frozenset({3, 4, 6, 8, 9, 10, 11, 12, 13, 14})  # opcodes that name a file
_FIRST_REPLY = 128


def handlers() -> Handlers:
    return {FileTransfer: _refuse}


def _refuse(request: Request) -> Replies:
    value: FileTransfer = request.value
    sequence, session, opcode, *_rest = _HEADER.unpack_from(value.payload)
    if opcode >= _FIRST_REPLY:
        return []
    error = FILE_NOT_FOUND if opcode in _ON_A_PATH else UNKNOWN_COMMAND
    head = _HEADER.pack((sequence + 1) % 65536, session, NAK, 1, opcode, 0, 0, 0)
    return [FileTransfer(request.sysid, request.compid, head + bytes([error]))]
