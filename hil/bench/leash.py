"""How far the world may go before the station has caught up (pure)."""

LEASH_S = 0.5  # ahead of the station's last tick
FIRST_LEASH_S = 1.0  # before the station has ticked at all; then at a pace that it can follow
BOOT_S, BOOT_SPEED = 180.0, 4.0  # a foreign firmware and its EKF take a minute of world time


class Leash:
    """World time not to pass. `now_s` is wall time; `speed` is the world's, 0 as fast as possible.

    While the station learns, a world without a pace of its own keeps to real time: learning needs
    the processor more, and nobody waits for the world.
    """

    def __init__(self, speed: float) -> None:
        self.until_s = 0.0
        self._pace = speed or 1.0
        self._boot_pace = speed or BOOT_SPEED
        self._began_s: float | None = None
        self._learning: tuple[float, float] | None = None  # wall and world time of its beginning
        self._absent: tuple[float, float] | None = None  # the same of its being away
        self._tick_s: float | None = None  # the last before that

    def go_on(self, now_s: float) -> bool:
        """The station is being started again: no world waits for that. Whether it is longer now."""
        self._absent = self._absent or (now_s, self.until_s)
        since_s, from_s = self._absent
        before_s, self.until_s = self.until_s, from_s + (now_s - since_s) * self._pace
        return self.until_s > before_s

    def lengthen(self, tick_s: float | None, learning: bool, now_s: float) -> bool:
        """Take the station's last tick; whether the leash is longer now.

        A station that was away has missed what was sent meanwhile: before it ticks again, time
        goes on as if it still were.
        """
        if self._absent is not None and tick_s == self._tick_s:
            return self.go_on(now_s)
        self._absent, self._tick_s = None, tick_s
        until_s = self._first_s(now_s) if tick_s is None else tick_s + LEASH_S
        if not learning:
            self._learning = None
        else:
            self._learning = self._learning or (now_s, until_s)
            since_s, from_s = self._learning
            until_s = min(until_s, from_s + (now_s - since_s) * self._pace)
        longer = until_s > self.until_s
        self.until_s = max(until_s, self.until_s)
        return longer

    def _first_s(self, now_s: float) -> float:
        """Before the first tick: links are measured, and firmwares boot."""
        if self._began_s is None:
            self._began_s = now_s
        return min(BOOT_S, FIRST_LEASH_S + (now_s - self._began_s) * self._boot_pace)
