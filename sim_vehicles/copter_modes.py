"""Copter modes: ArduPilot Copter's numbers for what this autopilot does under a rover's names."""

from hil.mavlink import CopterMode, RoverMode

_NUMBERS = {
    RoverMode.MANUAL: CopterMode.STABILIZE,
    RoverMode.HOLD: CopterMode.LOITER,
    RoverMode.GUIDED: CopterMode.GUIDED,
    RoverMode.AUTO: CopterMode.AUTO,
    RoverMode.RTL: CopterMode.RTL,
}
_MODES = {number: mode for mode, number in _NUMBERS.items()}


def copter_number(mode: RoverMode, landing: bool) -> int:
    """The custom_mode of a heartbeat."""
    return CopterMode.LAND if landing else _NUMBERS[mode]


def mode_of(number: int) -> RoverMode | None:
    """The mode that a copter's number asks for; None for one that is not implemented."""
    return _MODES.get(CopterMode(number)) if number in tuple(CopterMode) else None
