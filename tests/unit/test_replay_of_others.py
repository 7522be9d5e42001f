"""Replay of a fleet that a script of somebody else drove, as pymavlink would write its log."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from base_station.overheard import on_one_clock, others_drove
from base_station.records import Event
from base_station.replay import replay
from base_station.sent import sent_orders
from base_station.tlog import TlogWriter
from hil import mavlink
from hil.bench.folders import blind_view
from hil.cli import main
from hil.faults import to_injection
from hil.scenario import Scenario, StationView, load_scenario
from tests.conftest import SCENARIOS
from tests.vehicle_world import InWorld

SCRIPT = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
VELOCITY_ALONE = 3527  # type_mask
Velocities = dict[int, tuple[float, float]]  # north, east (m/s) by system id


class Script(InWorld):
    """Velocity set-points at 5 Hz without a time stamp; all of both directions goes to one log."""

    def __init__(self, scenario: Scenario, log: TlogWriter) -> None:
        self._log = log
        super().__init__(scenario)

    def send(self, sysid: int, message: dialect.MAVLink_message) -> None:
        datagram = message.pack(SCRIPT)
        SCRIPT.seq = (SCRIPT.seq + 1) % 256
        self._log.write(self._now_us, datagram)
        self.tell(datagram, sysid)

    def begin(self) -> None:
        """Armed and in GUIDED, the old way and the new one."""
        self.drive(1.5, {})
        for sysid in self.vehicles:
            arm = dialect.MAV_CMD_COMPONENT_ARM_DISARM
            self.send(sysid, dialect.MAVLink_command_long_message(sysid, 1, arm, 0, 1, *[0.0] * 6))
            self.send(sysid, dialect.MAVLink_set_mode_message(sysid, 1, 15))

    def drive(self, seconds: float, velocities: Velocities) -> None:
        for tick in range(round(seconds * 5)):
            for sysid in self.vehicles:
                if tick % 5 == 0:
                    self.send(sysid, dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
                if velocities:
                    north, east = velocities.get(sysid, (0.0, 0.0))
                    self.send(sysid, setpoint(sysid, north, east))
            for _ in range(self.scenario.clock.autopilot_hz // 5):
                self._frame()

    @property
    def _now_us(self) -> int:
        return 1_700_000_000_000_000 + round(self.time_s * 1e6)

    def _collect(self, sysid: int) -> None:
        for datagram in self.vehicles[sysid].outbox("gcs"):
            self._log.write(self._now_us, datagram)
        for datagram in self.vehicles[sysid].outbox("injector"):
            decoded = mavlink.Decoder().decode(datagram)
            self.values[sysid, "injector"] += [r.value for r in decoded]


def setpoint(
    sysid: int, north: float, east: float, frame: int = 1, mask: int = VELOCITY_ALONE
) -> dialect.MAVLink_message:
    return dialect.MAVLink_set_position_target_local_ned_message(
        0, sysid, 1, frame, mask, 0, 0, 0, north, east, 0, 0, 0, 0, 0, 0
    )


@pytest.fixture(scope="module")
def rescue() -> Scenario:
    return load_scenario(SCENARIOS / "rescue.yaml")


@pytest.fixture(scope="module")
def view(rescue: Scenario) -> StationView:
    return blind_view(rescue)


REST: Velocities = {1: (0.0, 0.0)}


def story(script: Script) -> None:
    """Everybody a bit to the east, a pause in GUIDED, then rover 3 runs into rover 2."""
    script.begin()
    for sysid in (1, 2, 3):
        for east_mps in (0.5, -0.5):
            script.drive(0.6, {sysid: (0.0, east_mps)})
            script.drive(1.0, REST)
    script.drive(4.0, REST)
    script.drive(4.0, {3: (0.0, -0.8)})
    script.drive(4.0, REST)


@pytest.fixture(scope="module")
def log(rescue: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "others.tlog"
    with TlogWriter(path) as writer:
        script = Script(rescue, writer)
        script.inject(to_injection(rescue.faults[0].fault()), sysid=2)
        story(script)
    return path


def test_a_fleet_that_others_drove_is_diagnosed(
    log: Path, view: StationView, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "view.json").write_text(view.model_dump_json())
    assert main(["replay", "--view", str(tmp_path / "view.json"), str(log)]) == 0
    told = capsys.readouterr().out.splitlines()
    assert "rover_2 does not answer as its twin does (east)" in told[0]
    assert "verdict" in told[-1]
    assert "rover_2: motor_y_off" in told[-1]


def test_a_sound_fleet_that_others_drove_raises_nothing(
    rescue: Scenario, view: StationView, tmp_path: Path
) -> None:
    assert decisions(rescue, view, tmp_path, story) == ()


def test_what_the_log_does_not_explain_ends_the_watch(
    rescue: Scenario, view: StationView, tmp_path: Path
) -> None:
    def taken_away(script: Script) -> None:
        script.begin()
        script.drive(2.0, {1: (0.5, 0.0)})
        script.send(1, dialect.MAVLink_set_mode_message(1, 1, 0))
        script.drive(3.0, REST)

    [end] = decisions(rescue, view, tmp_path, taken_away)
    assert end.kind == "end"
    assert "rover_1 is in mode 0" in end.text


def test_a_position_as_set_point_ends_the_watch(
    rescue: Scenario, view: StationView, tmp_path: Path
) -> None:
    def sent_there(script: Script) -> None:
        script.begin()
        script.drive(2.0, REST)
        script.send(1, setpoint(1, 0.0, 0.0, mask=3576))
        script.drive(2.0, {})

    assert "rover_1 was sent to a position" in decisions(rescue, view, tmp_path, sent_there)[0].text


def decisions(
    rescue: Scenario, view: StationView, tmp_path: Path, act: Callable[[Script], None]
) -> tuple[Event, ...]:
    """Of a sound fleet."""
    frames: list[tuple[int, bytes]] = []
    with TlogWriter(tmp_path / "a.tlog") as writer:
        writer.write = lambda time_us, frame: frames.append((time_us, frame))  # type: ignore[method-assign]
        act(Script(rescue, writer))
    return replay(view, frames)


def received(sysid: int, value: object) -> mavlink.Received:
    [message] = mavlink.Decoder().decode(mavlink.Encoder(sysid, 1).encode(value))  # type: ignore[arg-type]
    return message


def position(time_s: float) -> mavlink.LocalPosition:
    return mavlink.LocalPosition(time_s, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_boot_clocks_are_brought_to_the_first_vehicles(view: StationView) -> None:
    def stream() -> Iterator[tuple[int, mavlink.Received]]:
        for k in range(10):
            for sysid, boot_s, delay_s in ((1, 0.0, 0.01), (2, 70.0, 0.01 + 0.02 * (k % 3))):
                log_us = round((100.0 + 0.1 * k + delay_s) * 1e6)
                yield log_us, received(sysid, position(boot_s + 0.1 * k))

    rewritten = on_one_clock(view, list(stream()))
    times_s = [m.value.time_s for _, m in rewritten if isinstance(m.value, mavlink.LocalPosition)]
    assert times_s[::2] == pytest.approx(times_s[1::2], abs=1e-6)


def test_it_is_another_station_by_its_system_id(view: StationView) -> None:
    order = mavlink.LocalSetpoint(2, 1, 0.0, 1, VELOCITY_ALONE, None, (0.1, 0.0, 0.0), None, None)
    ours = received(view.station_sysid, order)
    assert others_drove(view, [(0, received(255, order))])
    assert not others_drove(view, [(0, received(255, order)), (1, ours)])


def test_velocities_in_the_body_frame_are_turned(view: StationView) -> None:
    def order(frame: int) -> mavlink.LocalSetpoint:
        velocity = (0.5, 0.0, 0.0)
        return mavlink.LocalSetpoint(2, 1, 0.0, frame, VELOCITY_ALONE, None, velocity, None, None)

    east = mavlink.Attitude(1.0, 0.0, 0.0, 1.5707963, 0.0, 0.0, 0.0)
    guided = mavlink.Heartbeat(10, 3, armed=True, custom_mode=15, system_status=4)
    said = [received(2, guided), received(2, east), received(2, position(1.0))]
    heard = [(k, message) for k, message in enumerate([*said, received(255, order(8))])]
    orders = sent_orders(view, heard).at(1.0)
    assert orders.driven.tolist() == [False, True, False]
    assert orders.setpoints[1, :2] == pytest.approx([0.0, 0.5], abs=1e-6)


def test_who_is_not_armed_is_not_driven(view: StationView) -> None:
    order = mavlink.LocalSetpoint(2, 1, 0.0, 1, VELOCITY_ALONE, None, (0.5, 0.0, 0.0), None, None)
    guided = mavlink.Heartbeat(10, 3, armed=False, custom_mode=15, system_status=4)
    for armed in (False, True):
        said = [replace(guided, armed=armed), position(1.0)]
        heard = [(k, received(2, value)) for k, value in enumerate(said)]
        orders = sent_orders(view, [*heard, (9, received(255, order))]).at(1.0)
        assert bool(orders.driven[1]) is armed
