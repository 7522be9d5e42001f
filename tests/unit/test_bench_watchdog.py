"""Who hangs."""

import pytest

from hil.bench.leash import Leash
from hil.bench.watchdog import FIRST_TICK_WITHIN_S, HANG_S, Watchdog
from hil.errors import ProcessDiedError


def test_the_leash_is_half_a_second_and_longer_before_the_first_tick() -> None:
    leash = Leash(0.0)
    assert leash.lengthen(None, False, 0.0)
    assert leash.until_s == 3.0
    assert not leash.lengthen(2.0, False, 0.0)
    assert leash.until_s == 3.0
    assert leash.lengthen(10.0, False, 0.0)
    assert leash.until_s == 10.5


def test_the_world_keeps_to_real_time_while_the_station_learns() -> None:
    leash = Leash(0.0)
    leash.lengthen(10.0, False, 100.0)
    leash.lengthen(10.4, True, 100.1)
    assert leash.until_s == 10.9
    leash.lengthen(10.8, True, 100.2)
    assert leash.until_s == pytest.approx(11.0)
    leash.lengthen(10.9, False, 100.2)
    assert leash.until_s == pytest.approx(11.4)


def test_a_pace_that_was_asked_for_is_kept_while_learning() -> None:
    leash = Leash(4.0)
    leash.lengthen(10.0, True, 0.0)
    leash.lengthen(20.0, True, 1.0)
    assert leash.until_s == pytest.approx(14.5)


def test_progress_of_either_is_progress() -> None:
    watchdog = Watchdog(1.0, 0.0)
    for i in range(1, 10):
        watchdog.check(
            world_s=float(i // 2), leash_s=0.0, tick_s=float((i + 1) // 2), now_s=5.0 * i
        )


@pytest.mark.parametrize(("world_s", "name"), [(10.5, "base-station"), (10.1, "world")])
def test_who_could_go_on_and_does_not_is_named(world_s: float, name: str) -> None:
    watchdog = Watchdog(1.0, 0.0)
    watchdog.check(world_s, 10.5, 10.0, 1.0)
    watchdog.check(world_s, 10.5, 10.0, 1.0 + HANG_S)
    with pytest.raises(ProcessDiedError, match=f"^{name} hangs"):
        watchdog.check(world_s, 10.5, 10.0, 1.1 + HANG_S)


def test_a_slow_world_is_not_a_hanging_one() -> None:
    watchdog = Watchdog(0.01, 0.0)
    watchdog.check(1.0, 1.5, 1.0, 0.0)
    watchdog.check(1.0, 1.5, 1.0, 30.0)


def test_the_first_tick_may_take_longer() -> None:
    watchdog = Watchdog(1.0, 0.0)
    watchdog.check(3.0, 3.0, None, 1.0)
    watchdog.check(3.0, 3.0, None, FIRST_TICK_WITHIN_S)
    with pytest.raises(ProcessDiedError, match="base-station hangs"):
        watchdog.check(3.0, 3.0, None, FIRST_TICK_WITHIN_S + 2.0)


def test_a_station_started_again_has_the_time_of_a_first_tick() -> None:
    watchdog = Watchdog(1.0, 0.0)
    watchdog.check(10.5, 10.5, 10.0, 1.0)
    watchdog.rest(100.0)
    watchdog.check(12.0, 10.5, 10.0, 100.0)  # the world went on meanwhile
    watchdog.check(12.0, 10.5, 10.0, 100.0 + FIRST_TICK_WITHIN_S)
    with pytest.raises(ProcessDiedError, match="base-station hangs"):
        watchdog.check(12.0, 10.5, 10.0, 100.1 + FIRST_TICK_WITHIN_S)
    watchdog.rest(200.0)
    watchdog.check(12.0, 12.5, 12.1, 201.0)  # it ticks: as before
    with pytest.raises(ProcessDiedError, match="hangs"):
        watchdog.check(12.0, 12.5, 12.1, 201.1 + HANG_S)
