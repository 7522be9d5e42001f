"""Telemetry on a common time base: order, age, clocks."""

import numpy as np
import pytest

from base_station.receiving.fleet import LINK_GIVEN_UP_WALL_S, LINK_LOST_WALL_S, Fleet
from base_station.receiving.fleet_clock import FleetClock
from base_station.receiving.telemetry import Sample, Track
from base_station.station import Station
from hil.mavlink import COMPONENT_AUTOPILOT, Heartbeat, LocalPosition, Received, Timesync
from hil.scenario import StationView


def _position(time_s: float, north_m: float) -> LocalPosition:
    return LocalPosition(time_s, (north_m, 0.0, 0.0), (1.0, 0.0, 0.0))


def test_late_and_doubled_packets_change_nothing() -> None:
    track = Track()
    for time_s, north in ((0.1, 1.0), (0.3, 3.0), (0.2, 99.0), (0.3, 99.0)):
        track.position(Sample(time_s, (north, 0.0), (0.0, 0.0)))
    assert [s.position_m[0] for s in track.samples] == [1.0, 3.0]


def test_a_sample_is_carried_forward_but_not_for_long() -> None:
    track = Track()
    track.position(Sample(1.0, (2.0, 0.0), (0.5, 0.0)))
    carried = track.at(1.2)
    assert carried is not None
    assert carried.position_m[0] == pytest.approx(2.1)
    assert track.at(2.0) is None


def test_a_frame_waits_for_all_vehicles_then_goes_on_without_the_late_one(
    rescue_view: StationView,
) -> None:
    fleet = Fleet(rescue_view)

    def hear(index: int, time_s: float) -> None:
        sysid = rescue_view.fleet[index].sysid
        message = Received(sysid, COMPONENT_AUTOPILOT, _position(time_s, time_s))
        fleet.receive(index, message, wall_s=time_s)

    for i in range(3):
        hear(i, 1.0)
    fleet.start_ticks()
    hear(0, 1.1)
    hear(1, 1.1)
    assert fleet.due() == []
    hear(2, 1.1)
    (frame,) = fleet.due()
    assert frame.time_s == pytest.approx(1.1)
    assert frame.fresh.all()
    for k in range(2, 8):
        hear(0, 1.0 + 0.1 * k)
        hear(1, 1.0 + 0.1 * k)
    late = fleet.due()
    assert [round(f.time_s, 1) for f in late] == [1.2, 1.3, 1.4]
    assert late[-1].fresh[2]  # carried forward 0.3 s
    assert np.isfinite(late[-1].position_m).all()


def test_a_message_from_a_stranger_on_the_link_is_ignored(rescue_view: StationView) -> None:
    fleet = Fleet(rescue_view)
    fleet.receive(0, Received(77, COMPONENT_AUTOPILOT, _position(1.0, 5.0)), wall_s=0.0)
    assert not fleet.tracks[0].samples


def test_boot_clocks_that_differ_are_brought_together() -> None:
    clock = FleetClock((1, 2))
    for k in range(30):
        asked_ns = k * 1_000_000_000
        jitter_ns = (7 * k % 5) * 20_000_000
        clock.reply(1, 5_000_000_000 + asked_ns, asked_ns, asked_ns + 1_000_000)
        delayed_ns = asked_ns + jitter_ns
        clock.reply(2, 9_000_000_000 + delayed_ns, asked_ns, delayed_ns + 1_000_000)
    assert clock.fleet_time_s(1, 5.0) == pytest.approx(5.0)
    assert clock.fleet_time_s(2, 9.0) == pytest.approx(5.0, abs=1e-3)


def test_answers_to_what_was_never_asked_tell_nothing_of_the_link(
    rescue_view: StationView,
) -> None:
    fleet = Fleet(rescue_view)
    for now_s, asked_s in ((50.0, 1e6), (51.0, -1e6), (52.0, 60.0)):
        answer = Timesync(int(now_s * 1e9), int(asked_s * 1e9))
        fleet.receive(0, Received(1, COMPONENT_AUTOPILOT, answer), now_s)
    assert fleet.tracks[0].round_trip_s == 0.0
    for boot_s, asked_s in ((9.0, 53.0), (1.0, 54.0)):  # a vehicle that lives backwards
        answer = Timesync(int(boot_s * 1e9), int(asked_s * 1e9))
        fleet.receive(0, Received(1, COMPONENT_AUTOPILOT, answer), asked_s + 0.1)
    assert fleet.tracks[0].round_trip_s == 0.0


def test_a_vehicle_that_falls_silent_is_named_and_the_fleet_holds(rescue_view: StationView) -> None:
    station = Station(rescue_view)

    def hear(indices: tuple[int, ...], wall_s: float) -> list[str]:
        beat = Heartbeat(10, 3, False, 4, 3)
        sysids = [rescue_view.fleet[i].sysid for i in indices]
        received = [
            (i, Received(s, COMPONENT_AUTOPILOT, beat))
            for i, s in zip(indices, sysids, strict=True)
        ]
        return [e.text for e in station.step(wall_s, received).events]

    assert hear((0, 1, 2), 0.0) == []
    for k in range(1, 11):
        assert hear((0, 2), LINK_LOST_WALL_S * k / 10) == []
    texts = hear((0, 2), LINK_LOST_WALL_S + 0.1)
    assert texts == ["no word from rover_2 for 5 s"]
    assert not station.desk.ended  # it is waited for
    for wall_s in np.arange(LINK_LOST_WALL_S + 0.5, LINK_GIVEN_UP_WALL_S, 0.5):
        assert hear((0, 2), float(wall_s)) == []
    assert "holding: a link is lost" in hear((0, 2), LINK_GIVEN_UP_WALL_S + 0.1)
    assert station.desk.ended
    assert hear((0, 2), LINK_GIVEN_UP_WALL_S + 1.0) == []


def test_silence_does_not_count_while_the_station_itself_is_not_running(
    rescue_view: StationView,
) -> None:
    station = Station(rescue_view)
    beat = Heartbeat(10, 3, False, 4, 3)
    heard = [
        (i, Received(m.sysid, COMPONENT_AUTOPILOT, beat)) for i, m in enumerate(rescue_view.fleet)
    ]
    station.step(0.0, heard)
    assert station.step(100.0, ()).events == ()
    for k in range(1, 10):
        assert station.step(100.0 + k / 2, ()).events == ()
    texts = [e.text for e in station.step(100.0 + LINK_LOST_WALL_S + 0.1, ()).events]
    assert texts[0] == "no word from rover_1, rover_2, rover_3 for 5 s"


@pytest.mark.parametrize("pace", [1.0, 20.0])
def test_the_round_trip_is_told_in_fleet_time_whatever_its_pace(
    rescue_view: StationView, pace: float
) -> None:
    """From the newest report that was known when TIMESYNC was asked until the vehicle got it."""
    fleet = Fleet(rescue_view)

    def hear(index: int, value: object, wall_s: float) -> None:
        sysid = rescue_view.fleet[index].sysid
        fleet.receive(index, Received(sysid, COMPONENT_AUTOPILOT, value), wall_s)

    one_way_s = 0.15
    for k in range(1, 40):
        sent_s = 0.1 * k
        heard_wall_s = (sent_s + one_way_s) / pace
        for index in range(3):
            hear(index, _position(sent_s, 0.0), heard_wall_s)
        got_s, asked_ns = sent_s + 2 * one_way_s, round(heard_wall_s * 1e9)
        answer = Timesync(round(got_s * 1e9), asked_ns)
        hear(0, answer, (got_s + one_way_s) / pace)
    assert fleet.tracks[0].round_trip_s == pytest.approx(2 * one_way_s, abs=1e-3)
    assert fleet.tracks[0].jitter_s == pytest.approx(0.0, abs=1e-3)
    assert fleet.tracks[1].round_trip_s == 0.0
    late = fleet.due()[-1]
    assert late.delay_s[0] == pytest.approx(fleet.newest_s - late.time_s + 0.3, abs=1e-3)
