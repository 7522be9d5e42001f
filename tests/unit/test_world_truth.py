"""Truth lines, contact episodes, pace and leash."""

import math

import pytest

from hil.errors import InputError
from hil.scenario import FaultModel
from hil.world.orders import Break, Mend, Order, OrderReader, Until, order_line, parse_order
from hil.world.pacing import Leash, Pace
from hil.world.truth import (
    Contact,
    ContactEpisode,
    ContactLog,
    TruthRecord,
    VehicleTruth,
    contact_line,
    parse_line,
    truth_line,
)

FAULT = FaultModel(vehicle=2, unit="motor", type="off", instances=(3,), applied_by="world")
PAIR, WALL = ("a", "b"), ("a", "wall_north")
HERE = (1.0, 2.0)


def test_lines_round_trip() -> None:
    record = TruthRecord(1.5, {1: VehicleTruth(1.0, 2.0, 0.25, -0.5, 0.0)})
    episode = ContactEpisode(1.0, 2.0, PAIR, 3.5, (0.5, -0.5))
    assert parse_line(truth_line(record)) == record
    assert parse_line(contact_line(episode)) == episode


@pytest.mark.parametrize("line", ["", "ready", "[]", "1", '{"type":"truth"}', '{"type":"contact"}'])
def test_other_lines_are_none(line: str) -> None:
    assert parse_line(line) is None


def test_contacts_close_in_time_are_one_episode() -> None:
    log = ContactLog()
    for time_s, impulse_ns in ((1.0, 2.0), (1.1, 5.0), (1.3, 1.0)):
        assert log.add(time_s, [Contact(time_s, PAIR, impulse_ns, (time_s, 0.0))]) == ()
    assert log.add(1.5, []) == ()
    assert log.add(1.6, []) == (ContactEpisode(1.0, 1.3, PAIR, 5.0, (1.1, 0.0)),)
    assert log.close() == ()


def test_pairs_do_not_mix_and_open_episodes_are_closed_at_the_end() -> None:
    log = ContactLog()
    log.add(1.0, [Contact(1.0, PAIR, 2.0, HERE), Contact(1.0, WALL, 1.0, HERE)])
    assert log.close() == (
        ContactEpisode(1.0, 1.0, PAIR, 2.0, HERE),
        ContactEpisode(1.0, 1.0, WALL, 1.0, HERE),
    )


def test_pace_is_real_time_times_speed() -> None:
    pace = Pace(2.0)
    assert pace.wait_s(0.0, 100.0) == 0.0
    assert pace.wait_s(1.0, 100.0) == 0.5
    assert pace.wait_s(1.0, 100.5) == 0.0


def test_a_late_world_does_not_sprint() -> None:
    pace = Pace(1.0)
    pace.wait_s(0.0, 0.0)
    assert pace.wait_s(1.0, 10.0) == 0.0
    assert pace.wait_s(2.0, 10.0) == 1.0


def test_speed_zero_never_waits() -> None:
    assert Pace(0.0).wait_s(math.inf, 0.0) == 0.0


def test_the_leash_never_shortens() -> None:
    leash = Leash(0.0)
    for until_s in (1.5, 1.0, math.nan, -math.inf):
        leash.lengthen(until_s)
    assert leash.until_s == 1.5


def test_orders_come_in_whole_lines_and_what_is_none_is_passed_over() -> None:
    reader = OrderReader()
    assert reader.feed(b"until 1") == []
    assert reader.feed(b".5\nuntil 1.0\nuntil x\nnonsense\n\xff\n") == [Until(1.5), Until(1.0)]


@pytest.mark.parametrize("order", [Until(2.25), Break(FAULT), Mend(FAULT)])
def test_orders_survive_the_way(order: Order) -> None:
    assert parse_order(order_line(order)) == order


def test_an_order_for_what_the_world_cannot_do_says_why() -> None:
    with pytest.raises(InputError, match="the world can't apply gps noise; it can motor off"):
        parse_order('break {"vehicle":1,"unit":"gps","type":"noise","size":1,"applied_by":"world"}')
    with pytest.raises(InputError, match=r"order to the world: break \{: Invalid JSON"):
        parse_order("break {")
