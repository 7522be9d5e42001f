"""What is let through to vehicles that may be real: fence, speed, contact, budget, consent."""

import math

import pytest

from base_station.autopilots import adapter
from base_station.commands import Arm, Command, Drive, SetMode, encode
from base_station.field.budget import loads, refuse_overload
from base_station.field.consent import ask_before_arming
from base_station.field.safety import disarm_all, permitted, stop_all
from base_station.receiving.telemetry import Sample, Track
from hil.errors import InputError
from hil.mavlink import COMPONENT_GCS, CommandLong, Decoder, Encoder, RoverMode
from hil.scenario import Safety, StationView

FAR = ((0.0, -2.5), (0.0, 0.0), (0.0, 2.5))
NEAR = ((0.0, -0.9), (0.0, 0.0), (0.0, 2.5))


def tracks(places: tuple[tuple[float, float], ...]) -> list[Track]:
    out = []
    for place in places:
        track = Track()
        track.position(Sample(1.0, place, (0.0, 0.0)))
        out.append(track)
    return out


def guarded(view: StationView, allow_contact: bool) -> StationView:
    return view.model_copy(update={"safety": Safety(allow_contact=allow_contact)})


def let(view: StationView, places: tuple[tuple[float, float], ...], drive: Drive) -> list[Command]:
    autopilots = [adapter(m.autopilot, m.frame) for m in view.fleet]
    return list(permitted(view, autopilots, tracks(places), [drive]).commands)


def test_a_simulation_is_not_meddled_with(rescue_view: StationView) -> None:
    reckless = Drive(1, 1.0, 0.0, 9.0, None)
    assert let(rescue_view, NEAR, reckless) == [reckless]


def test_speed_is_cut_and_the_direction_kept(rescue_view: StationView) -> None:
    (drive,) = let(guarded(rescue_view, False), FAR, Drive(1, 1.0, 3.0, -4.0, None))
    assert isinstance(drive, Drive)
    assert math.hypot(drive.north_mps, drive.east_mps) == pytest.approx(1.0)
    assert drive.east_mps / drive.north_mps == pytest.approx(-4.0 / 3.0)


def test_who_would_leave_is_held_and_who_is_out_may_come_back(rescue_view: StationView) -> None:
    view = guarded(rescue_view, False)
    edge = ((5.0, -2.5), *FAR[1:])
    assert let(view, edge, Drive(1, 1.0, 0.5, 0.0, None)) == [SetMode(1, int(RoverMode.HOLD))]
    home = Drive(1, 1.0, -0.5, 0.0, None)
    assert let(view, edge, home) == [home]


def test_without_leave_nobody_comes_into_reach_of_another(rescue_view: StationView) -> None:
    view = guarded(rescue_view, False)
    assert let(view, NEAR, Drive(1, 1.0, 0.0, 0.5, None)) == [SetMode(1, int(RoverMode.HOLD))]
    away = Drive(1, 1.0, 0.0, -0.5, None)
    assert let(view, NEAR, away) == [away]


def test_with_leave_it_meets_the_other_slowly(rescue_view: StationView) -> None:
    (drive,) = let(guarded(rescue_view, True), NEAR, Drive(1, 1.0, 0.0, 0.9, None))
    assert isinstance(drive, Drive)
    assert drive.east_mps == pytest.approx(0.3)
    light = Safety(allow_contact=True, contact_impulse_ns=0.8)  # 8 kg at 0.1 m/s
    view = rescue_view.model_copy(update={"safety": light})
    (drive,) = let(view, NEAR, Drive(1, 1.0, 0.0, 0.9, None))
    assert isinstance(drive, Drive)
    assert drive.east_mps == pytest.approx(0.1)


def test_who_is_lost_is_not_driven(rescue_view: StationView) -> None:
    view = guarded(rescue_view, True)
    autopilots = [adapter(m.autopilot, m.frame) for m in view.fleet]
    lost = [Track() for _ in view.fleet]
    allowed = permitted(view, autopilots, lost, [Drive(1, 1.0, 0.1, 0.0, None)])
    assert allowed.commands == (SetMode(1, int(RoverMode.HOLD)),)
    assert allowed.held[0].reason == "its position is not known"


def test_stop_and_emergency_stop_reach_everybody(rescue_view: StationView) -> None:
    autopilots = [adapter(m.autopilot, m.frame) for m in rescue_view.fleet]
    assert [c.sysid for c in stop_all(rescue_view, autopilots)] == [1, 2, 3]
    for order in disarm_all(rescue_view):
        datagram = encode(order, Encoder(250, COMPONENT_GCS), autopilots[0])
        (received,) = Decoder().decode(datagram)
        assert isinstance(order, Arm)
        assert isinstance(received.value, CommandLong)
        assert received.value.params[:2] == (0.0, 21196.0)


def on_radio(view: StationView, baud: int, telemetry_hz: int) -> StationView:
    update = {"mavlink_port": None, "connection": f"serial:/dev/ttyUSB0,{baud}"}
    fleet = tuple(m.model_copy(update=update | {"autopilot": "ardupilot"}) for m in view.fleet)
    clock = view.clock.model_copy(update={"telemetry_hz": telemetry_hz})
    return view.model_copy(update={"fleet": fleet, "clock": clock})


def test_the_budget_of_a_radio_by_hand(rescue_view: StationView) -> None:
    """Payload and 12 bytes: LOCAL_POSITION_NED 28, ATTITUDE 28, SERVO_OUTPUT_RAW 37, ..."""
    (load,) = loads(on_radio(rescue_view, 57_600, 5))
    each = 5 * 40 + 5 * 40 + 2.5 * 49 + 1 * 55 + 2 * 64 + 2 * 38 + 5 * 65 + 21 + 30
    assert load.bytes_per_s == pytest.approx(3 * each + 21 + 30, rel=0.02)
    refuse_overload(on_radio(rescue_view, 57_600, 5))


def test_a_radio_that_would_be_too_full_is_refused(rescue_view: StationView) -> None:
    with pytest.raises(InputError, match=r"57600: \d+ bytes/s are \d+ % of what it carries"):
        refuse_overload(on_radio(rescue_view, 57_600, 10))
    refuse_overload(on_radio(rescue_view, 115_200, 10))


def test_nothing_real_is_armed_without_a_word(
    rescue_view: StationView, capsys: pytest.CaptureFixture[str]
) -> None:
    real = on_radio(rescue_view, 57_600, 5)
    ask_before_arming(real, lambda: "arm\n")
    for answer in ("", "yes\n", "ARM\n"):
        with pytest.raises(InputError, match="no confirmation"):
            ask_before_arming(real, lambda answer=answer: answer)
    assert "rover_1, rover_2, rover_3 may be real" in capsys.readouterr().out


def test_a_simulation_needs_no_word(rescue_view: StationView) -> None:
    ask_before_arming(rescue_view, lambda: pytest.fail("asked"))
