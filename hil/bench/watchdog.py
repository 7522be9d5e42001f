"""Who hangs: neither station nor world gets on, though one of them could (pure)."""

from hil.errors import ProcessDiedError
from hil.world.simulation import TRUTH_HZ

HANG_S = 6.0  # with 3 s to stop and the recording to merge, within 10 s
FIRST_TICK_WITHIN_S = 30.0


class Watchdog:
    """`now_s` is wall time; `speed` is the world's, 0 for as fast as possible."""

    def __init__(self, speed: float, now_s: float) -> None:
        self._patience_s = max(HANG_S, 5.0 / (TRUTH_HZ * speed) if speed > 0.0 else 0.0)
        self._last: tuple[float, float | None] = (0.0, None)
        self._since_s = now_s
        self._awaits_tick = True  # the first, or the first of a station that was started again

    def rest(self, now_s: float) -> None:
        """The station is being started again: patience begins anew."""
        self._since_s = now_s
        self._awaits_tick = True

    def check(self, world_s: float, leash_s: float, tick_s: float | None, now_s: float) -> None:
        """Raises ProcessDiedError naming who hangs; `leash_s` is where the world has to wait."""
        if tick_s != self._last[1]:
            self._awaits_tick = False
        if (world_s, tick_s) != self._last:
            self._last, self._since_s = (world_s, tick_s), now_s
            return
        patience_s = max(self._patience_s, FIRST_TICK_WITHIN_S if self._awaits_tick else 0.0)
        if now_s - self._since_s <= patience_s:
            return
        world_waits = world_s + 1.0 / TRUTH_HZ >= leash_s - 1e-6
        who, other = ("base-station", "world") if world_waits else ("world", "base-station")
        raise ProcessDiedError(
            f"{who} hangs: nothing from it for {patience_s:.0f} s while the {other} waits for it"
        )
