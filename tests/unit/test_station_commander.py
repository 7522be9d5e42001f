"""Orders to commands: repeated until confirmed, silent towards a vehicle that was taken over."""

from dataclasses import replace

from base_station.commander import SURE_BEATS, TAKEOVER_S, UNHEEDED_S, Commander
from base_station.commands import Arm, Drive, SetMode
from base_station.execution import hold
from base_station.receiving.telemetry import Sample, Track
from hil.mavlink import RoverMode
from hil.scenario import StationView


def _tracks(mode: RoverMode, count: int = 3, beats: int = SURE_BEATS) -> list[Track]:
    tracks = [Track() for _ in range(count)]
    for track in tracks:
        track.status = replace(track.status, mode=int(mode), mode_beats=beats, armed=True)
    return tracks


def _drive_first(count: int = 3):  # type: ignore[no-untyped-def]
    orders = hold(count)
    orders.driven[0] = True
    orders.setpoints[0, :2] = (0.3, -0.2)
    return orders


def test_driving_asks_for_guided_and_sends_the_setpoint(rescue_view: StationView) -> None:
    commands = Commander(rescue_view).carry_out(_drive_first(), _tracks(RoverMode.HOLD), 1.0)
    assert commands[0] == SetMode(1, RoverMode.GUIDED)
    assert commands[1] == Drive(1, 1.0, 0.3, -0.2, None)


def test_a_mode_is_asked_for_again_until_it_is_confirmed(rescue_view: StationView) -> None:
    commander, tracks = Commander(rescue_view), _tracks(RoverMode.MANUAL)
    orders = hold(3)
    assert len(commander.carry_out(orders, tracks, 0.0)) == 3
    assert commander.carry_out(orders, tracks, 0.1) == []
    assert len(commander.carry_out(orders, tracks, 0.6)) == 3
    assert commander.carry_out(orders, _tracks(RoverMode.HOLD), 0.7) == []


def test_a_mode_nobody_commanded_is_a_takeover_and_ends_all_commands(
    rescue_view: StationView,
) -> None:
    commander, orders = Commander(rescue_view), hold(3)
    commander.carry_out(orders, _tracks(RoverMode.HOLD), 0.0)
    commander.carry_out(orders, _tracks(RoverMode.HOLD), 0.1)
    strayed = _tracks(RoverMode.HOLD)
    strayed[1].status = replace(strayed[1].status, mode=int(RoverMode.MANUAL))
    assert commander.carry_out(orders, strayed, 1.0) == []
    assert commander.takeovers(1.5) == []
    assert commander.takeovers(1.0 + TAKEOVER_S) == [1]
    commander.released.add(1)
    commands = commander.carry_out(_drive_first(), strayed, 5.0)
    assert {c.sysid for c in commands} == {1}


def test_arming_is_asked_only_of_those_that_are_not_armed(rescue_view: StationView) -> None:
    commander, tracks = Commander(rescue_view), _tracks(RoverMode.HOLD)
    tracks[2].status = replace(tracks[2].status, armed=False)
    assert commander.arm(tracks, 0.0) == [Arm(3)]
    assert commander.arm(tracks, 0.2) == []
    assert commander.arm(tracks, 0.6) == [Arm(3)]


def test_while_a_strange_mode_lasts_nothing_is_sent_even_if_the_orders_change(
    rescue_view: StationView,
) -> None:
    commander = Commander(rescue_view)
    commander.carry_out(hold(3), _tracks(RoverMode.HOLD), 0.0)
    strayed = _tracks(RoverMode.HOLD)
    strayed[0].status = replace(strayed[0].status, mode=int(RoverMode.MANUAL))
    assert commander.carry_out(_drive_first(), strayed, 1.0) == []
    assert commander.carry_out(_drive_first(), _tracks(RoverMode.HOLD), 1.5) != []


def test_a_failsafe_that_leaves_the_driven_mode_is_not_argued_with(
    rescue_view: StationView,
) -> None:
    commander, orders = Commander(rescue_view), _drive_first()
    commander.carry_out(orders, _tracks(RoverMode.HOLD), 0.0)
    guided = _tracks(RoverMode.HOLD)
    guided[0].status = replace(guided[0].status, mode=int(RoverMode.GUIDED))
    commander.carry_out(orders, guided, 0.1)
    assert commander.carry_out(orders, _tracks(RoverMode.HOLD), 1.0) == []
    commander.carry_out(orders, _tracks(RoverMode.HOLD), 1.0 + TAKEOVER_S)
    assert commander.takeovers(1.0 + TAKEOVER_S) == [0]


def test_a_vehicle_that_is_given_back_is_commanded_again(rescue_view: StationView) -> None:
    commander, tracks = Commander(rescue_view), _tracks(RoverMode.HOLD)
    commander.released.add(1)
    assert all(c.sysid != 2 for c in commander.carry_out(hold(3), tracks, 1.0))
    assert commander.give_back() == (1,)
    assert commander.released == set()
    tracks[1].status = replace(tracks[1].status, mode=int(RoverMode.MANUAL))
    assert SetMode(2, int(RoverMode.HOLD)) in commander.carry_out(hold(3), tracks, 2.0)
    assert commander.takeovers(2.0 + TAKEOVER_S) == []


def test_a_late_heartbeat_is_no_takeover_and_is_not_argued_with(rescue_view: StationView) -> None:
    commander, orders = Commander(rescue_view), _drive_first()
    commander.carry_out(orders, _tracks(RoverMode.HOLD), 0.0)
    guided = _tracks(RoverMode.HOLD)
    guided[0].status = replace(guided[0].status, mode=int(RoverMode.GUIDED))
    commander.carry_out(orders, guided, 0.1)
    late = _tracks(RoverMode.HOLD, beats=1)
    for time_s in (1.0, 1.0 + TAKEOVER_S):
        (command,) = commander.carry_out(orders, late, time_s)
        assert isinstance(command, Drive)
    assert commander.takeovers(1.0 + TAKEOVER_S) == []


def test_who_went_by_itself_to_the_mode_it_shall_have_was_not_taken_over(
    rescue_view: StationView,
) -> None:
    commander = Commander(rescue_view)
    commander.carry_out(_drive_first(), _tracks(RoverMode.HOLD), 0.0)
    guided = _tracks(RoverMode.HOLD)
    guided[0].status = replace(guided[0].status, mode=int(RoverMode.GUIDED))
    commander.carry_out(_drive_first(), guided, 0.1)
    for time_s in (5.0, 5.0 + TAKEOVER_S):  # the link was lost, its failsafe held it
        commander.carry_out(hold(3), _tracks(RoverMode.HOLD), time_s)
    assert commander.takeovers(5.0 + TAKEOVER_S) == []
    assert commander.carry_out(_drive_first(), _tracks(RoverMode.HOLD), 9.0)[0] == SetMode(
        1, RoverMode.GUIDED
    )


def test_a_disarm_nobody_commanded_is_a_takeover(rescue_view: StationView) -> None:
    commander, orders = Commander(rescue_view), hold(3)
    commander.carry_out(orders, _tracks(RoverMode.HOLD), 0.0)
    disarmed = _tracks(RoverMode.HOLD)
    disarmed[2].status = replace(disarmed[2].status, armed=False)
    for time_s in (1.0, 1.0 + TAKEOVER_S):
        commander.carry_out(orders, disarmed, time_s)
    assert commander.takeovers(1.0 + TAKEOVER_S) == [2]


def test_a_pilot_who_moves_a_stick_is_a_takeover(rescue_view: StationView) -> None:
    commander, orders = Commander(rescue_view), hold(3)
    rest, moved = _tracks(RoverMode.HOLD), _tracks(RoverMode.HOLD)
    rest[1].status = replace(rest[1].status, sticks_us=(1500, 65535, 1500, 0))
    moved[1].status = replace(moved[1].status, sticks_us=(1500, 1200, 1700, 0))
    commander.carry_out(orders, rest, 0.0)
    for time_s in (1.0, 1.0 + TAKEOVER_S):
        commander.carry_out(orders, moved, time_s)
    assert commander.takeovers(1.0 + TAKEOVER_S) == [1]


def test_an_autopilot_that_wants_setpoints_first_gets_them_while_it_holds(
    rescue_view: StationView,
) -> None:
    members = [m.model_copy(update={"autopilot": "px4"}) for m in rescue_view.fleet]
    view = rescue_view.model_copy(update={"fleet": tuple(members)})
    commands = Commander(view).carry_out(hold(3), _tracks(RoverMode.HOLD), 1.0)
    assert [c for c in commands if isinstance(c, Drive)] == [
        Drive(sysid, 1.0, 0.0, 0.0, None) for sysid in (1, 2, 3)
    ]


def test_an_order_that_may_still_be_under_way_is_waited_for_before_a_mode_counts(
    rescue_view: StationView,
) -> None:
    """A copy of the order before comes late: it is put right, and nobody has taken anything."""
    commander, driving, holding = Commander(rescue_view), _drive_first(), _tracks(RoverMode.HOLD)
    late = _tracks(RoverMode.HOLD)
    late[0].status = replace(late[0].status, mode=int(RoverMode.GUIDED))
    for tracks in (holding, late):
        for track in tracks:
            track.answered(1.0)
    commander.carry_out(driving, late, 0.0)
    commander.carry_out(hold(3), holding, 0.5)
    commander.carry_out(hold(3), holding, 1.0)  # GUIDED may come until 1.2 s
    assert SetMode(1, RoverMode.HOLD) in commander.carry_out(hold(3), late, 2.1)
    assert commander.takeovers(2.1 + TAKEOVER_S) == []


def test_one_that_is_heard_and_never_holds_is_given_up(rescue_view: StationView) -> None:
    commander, tracks = Commander(rescue_view), _tracks(RoverMode.GUIDED)
    commander.carry_out(_drive_first(), tracks, 0.0)
    for tenth in range(1, 10 * int(UNHEEDED_S) + 20):
        for track in tracks:
            track.position(Sample(0.1 * tenth, (0.0, 0.0), (0.0, 0.0)))
        commander.carry_out(hold(3), tracks, 0.1 * tenth)
        if tenth == 10 * int(UNHEEDED_S) - 10:
            assert commander.unheeding(0.1 * tenth) == []
    assert commander.unheeding(0.1 * tenth) == [0, 1, 2]


def test_heartbeats_from_before_an_order_do_not_confirm_it(rescue_view: StationView) -> None:
    """HOLD and GUIDED again at once: HOLD comes last, and the vehicle that stays in it is told."""
    commander, tracks = Commander(rescue_view), _tracks(RoverMode.GUIDED, beats=9)
    late = _tracks(RoverMode.GUIDED, beats=9)
    late[0].status = replace(late[0].status, mode=int(RoverMode.HOLD), mode_beats=2)
    for time_s, orders in ((0.0, _drive_first()), (1.0, hold(3)), (1.1, _drive_first())):
        commander.carry_out(orders, tracks, time_s)
    for tenth in (12, 13, 14, 15):
        commander.carry_out(_drive_first(), tracks, 0.1 * tenth)
    assert SetMode(1, RoverMode.GUIDED) in commander.carry_out(_drive_first(), late, 2.5)
    assert commander.takeovers(2.5 + TAKEOVER_S) == []
