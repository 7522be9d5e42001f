"""What a ground station asks: messages from a ground station to a vehicle, as typed values."""

from dataclasses import dataclass
from typing import Any, Self

from hil.mavlink.enums import MODE_FLAG_CUSTOM, MessageId, TypeMask
from hil.mavlink.message import Message, Vector, finite, milliseconds, text_from_wire, text_to_wire

Params = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class CommandLong(Message):
    """COMMAND_LONG. Params may be NaN, which some commands give a meaning."""

    ID = MessageId.COMMAND_LONG
    target_sysid: int
    target_compid: int
    command: int
    params: Params
    confirmation: int = 0

    @classmethod
    def from_wire(cls, *f: Any) -> Self:
        return cls(f[8], f[9], f[7], f[:7], f[10])

    def to_wire(self) -> tuple[Any, ...]:
        target = (self.target_sysid, self.target_compid)
        return (*self.params, self.command, *target, self.confirmation)


@dataclass(frozen=True, slots=True)
class CommandInt(Message):
    """COMMAND_INT: x and y are integers (1e-7 deg or 1e-4 m, as `frame` says)."""

    ID = MessageId.COMMAND_INT
    target_sysid: int
    target_compid: int
    frame: int
    command: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float

    @classmethod
    def from_wire(cls, *f: Any) -> Self:
        return cls(f[8], f[9], f[10], f[7], f[:4], f[4], f[5], f[6])

    def to_wire(self) -> tuple[Any, ...]:
        target = (self.target_sysid, self.target_compid)
        return (*self.params, self.x, self.y, self.z, self.command, *target, self.frame, 0, 0)


@dataclass(frozen=True, slots=True)
class LocalSetpoint(Message):
    """SET_POSITION_TARGET_LOCAL_NED. A field that the type mask ignores is None.

    Horizontal position or velocity counts as ignored when its x or its y is; an ignored z
    (down) reads 0. Frames are `Frame`; acceleration is not carried.
    """

    ID = MessageId.SET_POSITION_TARGET_LOCAL_NED
    target_sysid: int
    target_compid: int
    time_s: float
    frame: int
    type_mask: int
    position_m: Vector | None
    velocity_mps: Vector | None
    yaw_rad: float | None
    yaw_rate_radps: float | None

    @classmethod
    def from_wire(cls, ms: int, *f: Any) -> Self | None:
        mask = f[11]
        position = _masked(f[0:3], mask, TypeMask.X)
        velocity = _masked(f[3:6], mask, TypeMask.VX)
        yaw = None if mask & TypeMask.YAW else f[9]
        yaw_rate = None if mask & TypeMask.YAW_RATE else f[10]
        if not finite(*(position or ()), *(velocity or ()), yaw or 0.0, yaw_rate or 0.0):
            return None
        return cls(f[12], f[13], ms / 1e3, f[14], mask, position, velocity, yaw, yaw_rate)

    def to_wire(self) -> tuple[Any, ...]:
        motion = (*(self.position_m or (0.0,) * 3), *(self.velocity_mps or (0.0,) * 3))
        turn = (self.yaw_rad or 0.0, self.yaw_rate_radps or 0.0)
        target = (self.target_sysid, self.target_compid, self.frame)
        head = milliseconds(self.time_s)
        return (head, *motion, 0.0, 0.0, 0.0, *turn, self.type_mask, *target)


def _masked(xyz: tuple[float, float, float], mask: int, x_bit: TypeMask) -> Vector | None:
    bits = mask // int(x_bit)
    if bits & 0b011:
        return None
    return (xyz[0], xyz[1], 0.0 if bits & 0b100 else xyz[2])


@dataclass(frozen=True, slots=True)
class SetMode(Message):
    """SET_MODE, the old way next to MAV_CMD_DO_SET_MODE; it has no target component."""

    ID = MessageId.SET_MODE
    target_sysid: int
    custom_mode: int
    base_mode: int = MODE_FLAG_CUSTOM

    @classmethod
    def from_wire(cls, custom_mode: int, target_sysid: int, base_mode: int) -> Self:
        return cls(target_sysid, custom_mode, base_mode)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.custom_mode, self.target_sysid, self.base_mode)


@dataclass(frozen=True, slots=True)
class ParamRequestRead(Message):
    """PARAM_REQUEST_READ: by index, or by name when the index is -1."""

    ID = MessageId.PARAM_REQUEST_READ
    target_sysid: int
    target_compid: int
    name: str
    index: int = -1

    @classmethod
    def from_wire(cls, index: int, sysid: int, compid: int, name: bytes) -> Self:
        return cls(sysid, compid, text_from_wire(name), index)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.index, self.target_sysid, self.target_compid, text_to_wire(self.name))


@dataclass(frozen=True, slots=True)
class ParamRequestList(Message):
    """PARAM_REQUEST_LIST."""

    ID = MessageId.PARAM_REQUEST_LIST
    target_sysid: int
    target_compid: int

    @classmethod
    def from_wire(cls, target_sysid: int, target_compid: int) -> Self:
        return cls(target_sysid, target_compid)

    def to_wire(self) -> tuple[Any, ...]:
        return (self.target_sysid, self.target_compid)


@dataclass(frozen=True, slots=True)
class ParamSet(Message):
    """PARAM_SET. Integers travel as floats (C-cast). A value that is no number is dropped."""

    ID = MessageId.PARAM_SET
    target_sysid: int
    target_compid: int
    name: str
    value: float
    param_type: int

    @classmethod
    def from_wire(
        cls, value: float, sysid: int, compid: int, name: bytes, param_type: int
    ) -> Self | None:
        if not finite(value):
            return None
        return cls(sysid, compid, text_from_wire(name), value, param_type)

    def to_wire(self) -> tuple[Any, ...]:
        target = (self.target_sysid, self.target_compid)
        return (self.value, *target, text_to_wire(self.name), self.param_type)


@dataclass(frozen=True, slots=True)
class RequestDataStream(Message):
    """REQUEST_DATA_STREAM, the old way to set rates. Stream 0 is all of them."""

    ID = MessageId.REQUEST_DATA_STREAM
    target_sysid: int
    target_compid: int
    stream_id: int
    rate_hz: int
    start: bool

    @classmethod
    def from_wire(cls, rate_hz: int, sysid: int, compid: int, stream_id: int, start: int) -> Self:
        return cls(sysid, compid, stream_id, rate_hz, bool(start))

    def to_wire(self) -> tuple[Any, ...]:
        target = (self.target_sysid, self.target_compid)
        return (self.rate_hz, *target, self.stream_id, int(self.start))
