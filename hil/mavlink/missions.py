"""The mission protocol: lists of items, one request and one answer at a time.

Mission type 0 is the mission, 1 the fence, 2 the rally points, 255 (clear only) all of them.
"""

from dataclasses import dataclass
from typing import Any, Self

from hil.mavlink.enums import MessageId, MissionState
from hil.mavlink.message import Message


@dataclass(frozen=True, slots=True)
class MissionRequestList(Message):
    """MISSION_REQUEST_LIST: how many items are there?"""

    ID = MessageId.MISSION_REQUEST_LIST
    target_sysid: int
    target_compid: int
    mission_type: int = 0

    @classmethod
    def from_wire(cls, target_sysid: int, target_compid: int, mission_type: int) -> Self:
        return cls(target_sysid, target_compid, mission_type)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.target_sysid, self.target_compid, self.mission_type)


@dataclass(frozen=True, slots=True)
class MissionClearAll(MissionRequestList):
    """MISSION_CLEAR_ALL."""

    ID = MessageId.MISSION_CLEAR_ALL


@dataclass(frozen=True, slots=True)
class MissionCount(Message):
    """MISSION_COUNT: the answer to a list request, or the start of an upload."""

    ID = MessageId.MISSION_COUNT
    target_sysid: int
    target_compid: int
    count: int
    mission_type: int = 0

    @classmethod
    def from_wire(cls, count: int, sysid: int, compid: int, kind: int, *_opaque_id: int) -> Self:
        return cls(sysid, compid, count, kind)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.count, self.target_sysid, self.target_compid, self.mission_type)


@dataclass(frozen=True, slots=True)
class MissionRequestInt(Message):
    """MISSION_REQUEST_INT: send item `seq`."""

    ID = MessageId.MISSION_REQUEST_INT
    target_sysid: int
    target_compid: int
    seq: int
    mission_type: int = 0

    @classmethod
    def from_wire(cls, seq: int, target_sysid: int, target_compid: int, kind: int) -> Self:
        return cls(target_sysid, target_compid, seq, kind)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.seq, self.target_sysid, self.target_compid, self.mission_type)


@dataclass(frozen=True, slots=True)
class MissionRequest(MissionRequestInt):
    """MISSION_REQUEST, the deprecated form; MAVLink wants it answered like the new one."""

    ID = MessageId.MISSION_REQUEST


@dataclass(frozen=True, slots=True)
class MissionItem(Message):
    """MISSION_ITEM_INT: x and y are 1e-7 deg in global frames, z is an altitude (m).

    Numbers are as they came: params may be NaN (the default), and whether the rest makes sense is
    for the receiver to say, because a refusal must be answered.
    """

    ID = MessageId.MISSION_ITEM_INT
    target_sysid: int
    target_compid: int
    seq: int
    frame: int
    command: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float
    current: bool = False
    autocontinue: bool = True
    mission_type: int = 0

    @classmethod
    def from_wire(cls, *f: Any) -> Self:
        place = (f[4], f[5], f[6])
        return cls(f[9], f[10], f[7], f[11], f[8], f[:4], *place, bool(f[12]), bool(f[13]), f[14])

    def to_wire(self) -> tuple[Any, ...]:
        target = (self.target_sysid, self.target_compid, self.frame)
        flags = (int(self.current), int(self.autocontinue), self.mission_type)
        return (*self.params, self.x, self.y, self.z, self.seq, self.command, *target, *flags)


@dataclass(frozen=True, slots=True)
class MissionAck(Message):
    """MISSION_ACK; `result` is a `MissionResult`."""

    ID = MessageId.MISSION_ACK
    target_sysid: int
    target_compid: int
    result: int
    mission_type: int = 0

    @classmethod
    def from_wire(cls, sysid: int, compid: int, result: int, kind: int, *_opaque_id: int) -> Self:
        return cls(sysid, compid, result, kind)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.target_sysid, self.target_compid, self.result, self.mission_type)


@dataclass(frozen=True, slots=True)
class MissionSetCurrent(Message):
    """MISSION_SET_CURRENT: go on with item `seq`."""

    ID = MessageId.MISSION_SET_CURRENT
    target_sysid: int
    target_compid: int
    seq: int

    @classmethod
    def from_wire(cls, seq: int, target_sysid: int, target_compid: int) -> Self:
        return cls(target_sysid, target_compid, seq)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.seq, self.target_sysid, self.target_compid)


@dataclass(frozen=True, slots=True)
class MissionCurrent(Message):
    """MISSION_CURRENT: the item being driven; `total` does not count item 0, which is home."""

    ID = MessageId.MISSION_CURRENT
    seq: int
    total: int
    state: int = MissionState.NO_MISSION

    @classmethod
    def from_wire(cls, seq: int, total: int, state: int, _mode: int, *_ids: int) -> Self:
        return cls(seq, total, state)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.seq, self.total, int(self.state), 0)


@dataclass(frozen=True, slots=True)
class MissionItemReached(Message):
    """MISSION_ITEM_REACHED."""

    ID = MessageId.MISSION_ITEM_REACHED
    seq: int

    @classmethod
    def from_wire(cls, seq: int) -> Self:
        return cls(seq)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.seq,)
