"""Parameters: name, value, type, limits; those of ArduPilot Rover that this autopilot honours.

What has no effect here is not in the table, or is read-only and true.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from hil.airframe import Airframe
from hil.mavlink import ParamError, ParamType, RoverMode

ACCEPT_UNSIGNED = 1  # bit of MAV1_OPTIONS


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter with its default. `low` and `high` are the values it may be set to."""

    name: str
    default: float
    low: float
    high: float
    param_type: ParamType = ParamType.REAL32
    read_only: bool = False


class Parameters:
    """A table of parameters with their values; order and number never change."""

    def __init__(self, parameters: Iterable[Parameter]) -> None:
        self._parameters = {p.name: p for p in parameters}
        self._values = {p.name: p.default for p in self._parameters.values()}
        self.names = tuple(sorted(self._parameters))
        self.revision = 0  # counts the changes

    def __contains__(self, name: str) -> bool:
        return name in self._parameters

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def parameter(self, name: str) -> Parameter:
        return self._parameters[name]

    def name_at(self, index: int) -> str | None:
        return self.names[index] if 0 <= index < len(self.names) else None

    def set(self, name: str, value: float) -> ParamError | None:
        """Set a parameter that exists; None when it is done. Integers are cut, as by a C cast."""
        parameter = self._parameters[name]
        if parameter.param_type is not ParamType.REAL32:
            value = float(int(value))
        if parameter.read_only:
            return None if value == self._values[name] else ParamError.READ_ONLY
        if not parameter.low <= value <= parameter.high:
            return ParamError.VALUE_OUT_OF_RANGE
        self.revision += value != self._values[name]
        self._values[name] = value
        return None

    def changed(self) -> dict[str, float]:
        """What is no longer as it was delivered."""
        return {n: v for n, v in self._values.items() if v != self._parameters[n].default}


def _fixed(name: str, value: float, param_type: ParamType = ParamType.INT16) -> Parameter:
    return Parameter(name, value, value, value, param_type, read_only=True)


def _of_flight() -> tuple[Parameter, ...]:
    """ArduPilot Copter's."""
    return (
        Parameter("DISARM_DELAY", 10, 0, 127, ParamType.INT8),  # s armed on the ground, 0 never
        Parameter("RTL_ALT", 500, 30, 300_000),  # cm
    )


def _options(signs: bool) -> Parameter:
    """MAV1_OPTIONS (ArduPilot 4.7), of all ports here. Without a key there is nothing to choose."""
    if not signs:
        return _fixed("MAV1_OPTIONS", ACCEPT_UNSIGNED)
    return Parameter("MAV1_OPTIONS", 0, 0, ACCEPT_UNSIGNED, ParamType.INT16)


def rover_parameters(
    sysid: int, station_sysid: int, airframe: Airframe, signs: bool = False
) -> Parameters:
    """The table that a ground station sees. Names and units are ArduPilot Rover 4.6's.

    `signs`: the vehicle has a key to sign MAVLink with.
    """
    limit_mps = airframe.speed_limit_mps
    int8, int16 = ParamType.INT8, ParamType.INT16
    first = 73 if airframe.steering == "skid" else 33  # throttle left and right, or motor 1
    cruise_mps = airframe.motors[0].free_speed_mps / 2.0  # speed at CRUISE_THROTTLE percent
    return Parameters(
        (
            _fixed("ARMING_CHECK", 1),  # all of them
            Parameter("BATT_CRT_VOLT", 0, 0, 100),  # V, 0 is not watched
            Parameter("BATT_FS_CRT_ACT", 0, 0, 2, int8),  # 0 report, 1 RTL, 2 hold
            Parameter("BATT_FS_LOW_ACT", 0, 0, 2, int8),
            Parameter("BATT_LOW_TIMER", 10, 0, 120, int8),  # s below, until it counts
            Parameter("BATT_LOW_VOLT", 0, 0, 100),
            _fixed("CRUISE_SPEED", cruise_mps, ParamType.REAL32),
            _fixed("CRUISE_THROTTLE", 50, int8),
            _fixed("FORMAT_VERSION", 16),
            _fixed("FRAME_CLASS", 1, int8),
            _fixed("FRAME_TYPE", airframe.frame_type, int8),
            Parameter("FENCE_ACTION", 2, 0, 2, int8),  # 0 report, 1 RTL, 2 hold
            Parameter("FENCE_ENABLE", 0, 0, 1, int8),
            Parameter("FENCE_RADIUS", 300, 0.5, 10_000),
            Parameter("FENCE_TYPE", 6, 0, 7, int8),  # bits: 2 circle around home, 4 zones
            Parameter("FS_EKF_ACTION", 1, 1, 2, int8),  # 1 hold, 2 report
            Parameter("FS_GCS_ENABLE", 1, 0, 1, int8),
            Parameter("FS_TIMEOUT", 5, 1, 100),
            _fixed("FS_ACTION", 2, int8),  # hold
            _fixed("INITIAL_MODE", RoverMode.HOLD, int8),
            *(_fixed(f"SERVO{i}_FUNCTION", first + i) for i in range(len(airframe.motors))),
            *(_fixed(f"SERVO{i}_MIN", 1100) for i in range(1, len(airframe.motors) + 1)),
            *(_fixed(f"SERVO{i}_MAX", 1900) for i in range(1, len(airframe.motors) + 1)),
            *(_fixed(f"SERVO{i}_TRIM", 1500) for i in range(1, len(airframe.motors) + 1)),
            _options(signs),
            *(_of_flight() if airframe.flight else ()),
            Parameter("SYSID_MYGCS", station_sysid, 1, 255, int16),
            _fixed("SYSID_THISMAV", sysid),
            Parameter("WP_RADIUS", 0.2, 0.05, 100),
            Parameter("WP_SPEED", limit_mps, 0.05, limit_mps),
        )
    )
