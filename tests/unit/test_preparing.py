"""Before a fleet is driven: origins, rates and settings, asked for until they are there."""

import pytest

from base_station.autopilots import adapter
from base_station.commands import AskRate, AskTime, RequestMessage, SetParameter
from base_station.receiving.fleet import Fleet
from base_station.receiving.local_origin import PAIRS, LocalOrigin
from base_station.receiving.preparing import ANSWERS, SETTLED_S, Preparation
from hil.frames import Origin, ned_to_wgs84
from hil.mavlink import (
    COMPONENT_AUTOPILOT,
    Attitude,
    EkfStatus,
    GlobalPosition,
    GpsOrigin,
    GpsRaw,
    HomePosition,
    LocalPosition,
    MessageId,
    ParamType,
    ParamValue,
    Received,
    ServoOutputs,
    Timesync,
)
from hil.scenario import StationView

ORIGIN = Origin(47.397742, 8.545594, 488.0)
CM = 0.006  # half of 1e-7 deg


def local(time_s: float, north_m: float = 0.0, east_m: float = 0.0) -> LocalPosition:
    return LocalPosition(time_s, (north_m, east_m, 0.0), (0.0, 0.0, 0.0))


def test_the_word_on_the_origin_is_the_offset() -> None:
    place = LocalOrigin(ORIGIN)
    assert place.offset_m is None
    place.hear(GpsOrigin(*ned_to_wgs84(3.0, -2.0, ORIGIN), 480.0))
    assert place.offset_m == pytest.approx((3.0, -2.0), abs=CM)


def test_home_will_do_and_is_in_both_frames() -> None:
    place = LocalOrigin(ORIGIN)
    place.hear(HomePosition(*ned_to_wgs84(5.0, 1.0, ORIGIN), 480.0, (2.0, 3.0, 0.0)))
    assert place.offset_m == pytest.approx((3.0, -2.0), abs=CM)


def test_global_less_local_positions_will_do() -> None:
    place = LocalOrigin(ORIGIN)
    for k in range(PAIRS):
        place.hear(local(0.1 * k, 0.5, 0.5))
        assert place.offset_m is None
        lat, lon = ned_to_wgs84(3.5, -1.5, ORIGIN)
        place.hear(GlobalPosition(0.1 * k, lat, lon, 488.0, 0.0, (0.0, 0.0, 0.0), 0.0))
    assert place.offset_m == pytest.approx((3.0, -2.0), abs=CM)


def ardupilots(view: StationView) -> StationView:
    members = [m.model_copy(update={"autopilot": "ardupilot"}) for m in view.fleet]
    return view.model_copy(update={"fleet": tuple(members)})


def test_positions_are_in_the_fleets_frame_and_wait_for_the_origin(
    rescue_view: StationView,
) -> None:
    view = ardupilots(rescue_view)
    fleet = Fleet(view)

    def hear(value: object) -> None:
        fleet.receive(1, Received(2, COMPONENT_AUTOPILOT, value), 0.0)  # type: ignore[arg-type]

    hear(local(1.0, 1.0, 1.0))
    assert not fleet.tracks[1].samples
    hear(GpsOrigin(*ned_to_wgs84(3.0, -2.0, view.origin.origin()), 480.0))
    hear(local(1.1, 1.0, 1.0))
    assert fleet.tracks[1].samples[-1].position_m == pytest.approx((4.0, -1.0), abs=CM)


def prepared(view: StationView) -> Preparation:
    member = ardupilots(view).fleet[0]
    return Preparation(member, adapter("ardupilot", member.frame), 10.0, 250)


def test_settings_are_set_until_they_read_back_as_wanted(rescue_view: StationView) -> None:
    preparation = prepared(rescue_view)

    def asked(wall_s: float) -> set[str]:
        return {c.name for c in preparation.asks(wall_s) if isinstance(c, SetParameter)}

    assert asked(0.0) == {"MAV_GCS_SYSID", "SYSID_MYGCS", "FS_GCS_ENABLE"}
    assert asked(0.5) == set()
    preparation.hear(ParamValue("SYSID_MYGCS", 255.0, 0, 900, ParamType.INT16))
    preparation.hear(ParamValue("FS_GCS_ENABLE", 1.0, 1, 900, ParamType.INT8))
    assert asked(1.0) == {"MAV_GCS_SYSID", "SYSID_MYGCS"}
    preparation.hear(ParamValue("SYSID_MYGCS", 250.0, 0, 900, ParamType.INT16))
    assert asked(2.0) == set()


def test_rates_are_asked_for_until_they_come_and_a_slow_one_is_complained_of_once(
    rescue_view: StationView,
) -> None:
    preparation = prepared(rescue_view)
    asked = {c.message for c in preparation.asks(0.0) if isinstance(c, AskRate)}
    assert MessageId.LOCAL_POSITION_NED in asked
    still = (0.0, 0.0, 0.0)
    for k in range(round(SETTLED_S * 10) + 1):
        now_s = 100.0 + 0.1 * k
        preparation.hear(local(now_s))
        if k % 5 == 0:  # 2 Hz instead of 10
            preparation.hear(Attitude(now_s, *still, *still))
            preparation.hear(ServoOutputs(now_s, (1500,) * 16))
            preparation.hear(GpsRaw(now_s, 3, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 10))
            preparation.hear(EkfStatus(0.0, 0.0, 0.0, 0.0, 831))
        if k == 20:
            assert preparation.warnings() == ()
    asked = {c.message for c in preparation.asks(2.0) if isinstance(c, AskRate)}
    assert asked == {MessageId.ATTITUDE, MessageId.SERVO_OUTPUT_RAW, MessageId.SYS_STATUS}
    warnings = preparation.warnings()
    assert "rover_1 sends ATTITUDE at 2.0 Hz instead of 10" in warnings
    assert preparation.warnings() == ()


def test_the_origin_is_requested_until_it_is_known(rescue_view: StationView) -> None:
    preparation = prepared(rescue_view)
    assert any(isinstance(c, RequestMessage) for c in preparation.asks(0.0))
    assert not preparation.done
    preparation.hear(GpsOrigin(47.0, 8.0, 480.0))
    assert not any(isinstance(c, RequestMessage) for c in preparation.asks(1.0))


def test_our_own_vehicles_need_but_tell_the_time(rescue_view: StationView) -> None:
    member = rescue_view.fleet[0]
    preparation = Preparation(member, adapter("testbed", member.frame), 10.0, 250)
    for k in range(ANSWERS):
        assert not preparation.done
        asked_s = 0.5 * k
        assert preparation.asks(asked_s) == [AskTime(member.sysid, round(asked_s * 1e9))]
        preparation.hear(Timesync(1_000_000_000, round(asked_s * 1e9)))
    assert preparation.done
    assert preparation.asks(0.5 * ANSWERS) == []


def test_who_does_not_tell_the_time_is_complained_of_and_driven(rescue_view: StationView) -> None:
    member = rescue_view.fleet[0]
    preparation = Preparation(member, adapter("testbed", member.frame), 10.0, 250)
    for time_s in (0.0, SETTLED_S):
        preparation.hear(local(time_s))
    assert preparation.done
    assert preparation.warnings() == (
        "rover_1 does not answer TIMESYNC: its link's delay is not known",
    )
