"""How far the world may go before the station has caught up."""

import pytest

from hil.bench.leash import BOOT_SPEED, FIRST_LEASH_S, LEASH_S, Leash


def test_before_the_first_tick_time_passes_as_fast_as_a_station_can_follow() -> None:
    leash = Leash(speed=0.0)
    leash.lengthen(None, False, now_s=100.0)
    assert leash.until_s == pytest.approx(FIRST_LEASH_S)
    leash.lengthen(None, False, now_s=102.0)
    assert leash.until_s == pytest.approx(FIRST_LEASH_S + 2.0 * BOOT_SPEED)


def test_the_world_is_a_little_ahead_of_the_last_tick() -> None:
    leash = Leash(speed=0.0)
    assert leash.lengthen(7.0, False, now_s=0.0)
    assert leash.until_s == 7.0 + LEASH_S
    assert not leash.lengthen(7.0, False, now_s=9.0)


def test_a_station_that_has_come_back_is_told_what_it_needs_for_its_next_tick() -> None:
    """It has missed all reports up to the end of the leash: if the world stood, both would wait."""
    leash = Leash(speed=2.0)
    leash.lengthen(7.0, False, now_s=0.0)
    leash.go_on(now_s=1.0)
    leash.go_on(now_s=2.0)
    assert leash.until_s == pytest.approx(7.0 + LEASH_S + 2.0)
    assert leash.lengthen(7.0, False, now_s=3.0)
    assert leash.until_s == pytest.approx(7.0 + LEASH_S + 4.0)
    assert leash.lengthen(12.0, False, now_s=4.0)
    assert leash.until_s == 12.0 + LEASH_S


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
