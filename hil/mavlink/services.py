"""What goes both ways, or answers a request: parameters, commands, time, files."""

from dataclasses import dataclass
from typing import Any, Self

from hil.mavlink.enums import MessageId, ParamType
from hil.mavlink.message import Message, finite, text_from_wire, text_to_wire


@dataclass(frozen=True, slots=True)
class CommandAck(Message):
    """COMMAND_ACK, addressed to whoever sent the command; `result` is a `Result`."""

    ID = MessageId.COMMAND_ACK
    command: int
    result: int
    target_sysid: int
    target_compid: int

    @classmethod
    def from_wire(
        cls, command: int, result: int, _progress: int, _param2: int, sysid: int, compid: int
    ) -> Self:
        return cls(command, result, sysid, compid)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.command, self.result, 0, 0, self.target_sysid, self.target_compid)


@dataclass(frozen=True, slots=True)
class Timesync(Message):
    """TIMESYNC in ns. tc1 = 0 is the question; the answer has tc1 set and mirrors ts1."""

    ID = MessageId.TIMESYNC
    tc1_ns: int
    ts1_ns: int

    @classmethod
    def from_wire(cls, tc1_ns: int, ts1_ns: int) -> Self:
        return cls(tc1_ns, ts1_ns)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.tc1_ns, self.ts1_ns)


@dataclass(frozen=True, slots=True)
class Ping(Message):
    """PING. Target 0 is the question; the answer names who asked."""

    ID = MessageId.PING
    time_usec: int
    seq: int
    target_sysid: int
    target_compid: int

    @classmethod
    def from_wire(cls, time_usec: int, seq: int, target_sysid: int, target_compid: int) -> Self:
        return cls(time_usec, seq, target_sysid, target_compid)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.time_usec, self.seq, self.target_sysid, self.target_compid)


@dataclass(frozen=True, slots=True)
class ParamValue(Message):
    """PARAM_VALUE; `index` and `count` let a client see when it has them all."""

    ID = MessageId.PARAM_VALUE
    name: str
    value: float
    index: int
    count: int
    param_type: int = ParamType.REAL32

    @classmethod
    def from_wire(
        cls, value: float, count: int, index: int, name: bytes, param_type: int
    ) -> Self | None:
        if not finite(value):
            return None
        return cls(text_from_wire(name), value, index, count, param_type)

    def to_wire(self) -> tuple[Any, ...]:
        name = text_to_wire(self.name)
        return (self.value, self.count, self.index, name, self.param_type)


@dataclass(frozen=True, slots=True)
class ParamFailed(Message):
    """PARAM_ERROR: `error` is a `ParamError`, addressed to whoever asked."""

    ID = MessageId.PARAM_ERROR
    target_sysid: int
    target_compid: int
    name: str
    index: int
    error: int

    @classmethod
    def from_wire(cls, index: int, sysid: int, compid: int, name: bytes, error: int) -> Self:
        return cls(sysid, compid, text_from_wire(name), index, error)

    def to_wire(self) -> tuple[Any, ...]:
        target = (self.target_sysid, self.target_compid)
        return (self.index, *target, text_to_wire(self.name), self.error)


@dataclass(frozen=True, slots=True)
class MessageInterval(Message):
    """MESSAGE_INTERVAL in us: -1 is off, 0 is not available."""

    ID = MessageId.MESSAGE_INTERVAL
    message_id: int
    interval_us: int

    @classmethod
    def from_wire(cls, interval_us: int, message_id: int) -> Self:
        return cls(message_id, interval_us)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.interval_us, self.message_id)


@dataclass(frozen=True, slots=True)
class FileTransfer(Message):
    """FILE_TRANSFER_PROTOCOL with its 251 bytes of payload."""

    ID = MessageId.FILE_TRANSFER_PROTOCOL
    target_sysid: int
    target_compid: int
    payload: bytes

    @classmethod
    def from_wire(cls, _network: int, sysid: int, compid: int, *payload: int) -> Self:
        return cls(sysid, compid, bytes(payload))

    def to_wire(self) -> tuple[Any, ...]:
        return (0, self.target_sysid, self.target_compid, *self.payload.ljust(251, b"\0"))
