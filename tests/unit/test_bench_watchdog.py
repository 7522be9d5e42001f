"""Who hangs."""

import pytest

from hil.bench.watchdog import FIRST_TICK_WITHIN_S, HANG_S, Watchdog
from hil.errors import ProcessDiedError


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
