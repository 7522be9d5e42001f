"""How an autopilot speaks with the world: JSON frames, or MAVLink's HIL messages (pure)."""

from abc import ABC, abstractmethod

from hil.frames import Origin
from hil.hil_link import HilLink
from hil.mavlink import Decoder
from hil.physics_link import (
    PhysicsState,
    ServoFrame,
    decode_frame,
    encode_state,
    pad_channels,
)
from hil.scenario import Scenario, Vehicle

GPS_HZ = 5


class Wire(ABC):
    """One vehicle's. What it does not understand is no frame."""

    @abstractmethod
    def is_welcome(self, datagram: bytes) -> bool:
        """Whether somebody who sends that may be the autopilot."""

    @abstractmethod
    def frames(self, datagram: bytes) -> list[ServoFrame]: ...

    @abstractmethod
    def reply(self, state: PhysicsState) -> bytes: ...


class JsonWire(Wire):
    """ArduPilot's JSON interface, which our own vehicles speak, too."""

    def is_welcome(self, datagram: bytes) -> bool:
        return decode_frame(datagram) is not None

    def frames(self, datagram: bytes) -> list[ServoFrame]:
        frame = decode_frame(datagram)
        return [] if frame is None else [frame]

    def reply(self, state: PhysicsState) -> bytes:
        return encode_state(state)


class HilWire(Wire):
    """A board in HIL mode that answers each HIL_SENSOR with HIL_ACTUATOR_CONTROLS.

    Its frames are counted here. Before the first controls a heartbeat stands for a frame without
    pulses: so the first HIL_SENSOR has a way to go.
    """

    def __init__(self, origin: Origin, physics_hz: int) -> None:
        self._link, self._decoder, self._hz = HilLink(origin), Decoder(), physics_hz
        self._count, self._controlled = 0, False
        self._next_fix_s = 0.0

    def is_welcome(self, datagram: bytes) -> bool:
        return bool(Decoder().decode(datagram)) or bool(self._link.controls(datagram))

    def frames(self, datagram: bytes) -> list[ServoFrame]:
        wanted = [c.pwm_us for c in self._link.controls(datagram)]
        self._controlled = self._controlled or bool(wanted)
        if not self._controlled and self._decoder.decode(datagram):
            wanted = [()]
        return [self._frame(pwm_us) for pwm_us in wanted]

    def reply(self, state: PhysicsState) -> bytes:
        """HIL_SENSOR, and HIL_GPS when the receiver has a new fix."""
        sensor = self._link.sensor(state)
        if state.time_s < self._next_fix_s - 1e-6:
            return sensor
        self._next_fix_s = state.time_s + 1.0 / GPS_HZ
        return sensor + self._link.gps(state)

    def _frame(self, pwm_us: tuple[int, ...]) -> ServoFrame:
        self._count += 1
        return ServoFrame(self._hz, self._count, pad_channels(pwm_us))


def wire_of(vehicle: Vehicle, scenario: Scenario) -> Wire:
    """As the scenario says of that vehicle (`physics`)."""
    if vehicle.physics == "hil":
        return HilWire(scenario.origin.origin(), scenario.clock.physics_hz)
    return JsonWire()
