"""The station's commands against a stand-in that accepts and refuses as PX4 does.

Not the firmware: what is checked is what its documentation says of OFFBOARD.
"""

from dataclasses import dataclass, replace

import pytest

from base_station.autopilots import adapter
from base_station.commander import TAKEOVER_S, Commander
from base_station.commands import Command, encode
from base_station.execution import Orders, hold
from base_station.receiving.telemetry import Track
from hil.airframe import OMNI_PLUS
from hil.mavlink import COMPONENT_GCS, CommandLong, Decoder, Encoder, LocalSetpoint
from hil.mavlink import Command as MavCommand
from hil.scenario import StationView

OFFBOARD, LOITER, POSCTL = 6 << 16, 4 << 16 | 3 << 24, 3 << 16
LOSS_S = 0.5  # COM_OF_LOSS_T


@dataclass
class StandIn:
    """Modes as in px4_custom_mode. OFFBOARD needs a stream of set-points, and ends with it."""

    mode: int = LOITER
    armed: bool = False
    setpoint_s: float = float("-inf")
    refused: int = 0

    def receive(self, datagram: bytes, now_s: float) -> None:
        for message in Decoder().decode(datagram):
            match message.value:
                case LocalSetpoint():
                    self.setpoint_s = now_s
                case CommandLong(command=MavCommand.DO_SET_MODE, params=p):
                    self._switch(int(p[1]) << 16 | int(p[2]) << 24, now_s)
                case CommandLong(command=MavCommand.COMPONENT_ARM_DISARM, params=p):
                    self.armed = p[0] == 1.0

    def step(self, now_s: float) -> None:
        if self.mode == OFFBOARD and now_s - self.setpoint_s > LOSS_S:
            self.mode = LOITER  # COM_OBL_RC_ACT = 5

    def _switch(self, mode: int, now_s: float) -> None:
        if mode == OFFBOARD and now_s - self.setpoint_s > LOSS_S:
            self.refused += 1
            return
        self.mode = mode


class Session:
    """A commander, and a stand-in as its first vehicle, at 10 Hz."""

    def __init__(self, view: StationView) -> None:
        member = view.fleet[0].model_copy(update={"autopilot": "px4"})
        self.view = view.model_copy(update={"fleet": (member,)})
        self.commander, self.vehicle = Commander(self.view), StandIn()
        self.track, self.now_s = Track(), 0.0
        self._encoder = Encoder(250, COMPONENT_GCS)

    def run(self, orders: Orders, duration_s: float) -> list[Command]:
        sent: list[Command] = []
        for _ in range(round(duration_s * 10)):
            self.now_s += 0.1
            status = replace(self.track.status, mode=self.vehicle.mode, armed=self.vehicle.armed)
            self.track.status = status
            commands = self.commander.arm([self.track], self.now_s)
            commands += self.commander.carry_out(orders, [self.track], self.now_s)
            for command in commands:
                datagram = encode(command, self._encoder, adapter("px4", OMNI_PLUS))
                self.vehicle.receive(datagram, self.now_s)
            self.vehicle.step(self.now_s)
            sent += commands
        return sent


def driven() -> Orders:
    orders = hold(1)
    orders.driven[0] = True
    orders.setpoints[0, :2] = (0.3, 0.0)
    return orders


@pytest.fixture
def session(rescue_view: StationView) -> Session:
    return Session(rescue_view)


def test_it_is_armed_and_driven_in_offboard_and_held_after(session: Session) -> None:
    session.run(hold(1), 1.0)
    assert (session.vehicle.armed, session.vehicle.mode) == (True, LOITER)
    session.run(driven(), 1.0)
    assert session.vehicle.mode == OFFBOARD
    session.run(hold(1), 1.0)
    assert session.vehicle.mode == LOITER
    assert session.vehicle.refused == 0  # set-points flowed before it was asked


def test_without_a_stream_it_is_refused(session: Session) -> None:
    px4 = adapter("px4", OMNI_PLUS)
    encoder = Encoder(250, COMPONENT_GCS)
    session.vehicle.receive(px4.set_mode(encoder, 1, px4.driven_mode), 5.0)
    assert (session.vehicle.mode, session.vehicle.refused) == (LOITER, 1)


def test_a_pilot_in_position_mode_is_left_alone(session: Session) -> None:
    session.run(driven(), 1.0)
    session.vehicle.mode = POSCTL
    session.run(driven(), 0.2)
    assert session.run(driven(), TAKEOVER_S) == []
    assert session.vehicle.mode == POSCTL
    assert session.commander.takeovers(session.now_s) == [0]
