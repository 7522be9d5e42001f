"""How far the world may go: real time x speed, and the leash (pure)."""

import math
from dataclasses import dataclass

SLIP_S = 0.1


@dataclass
class Pace:
    """World time may reach `speed` x wall time; speed 0 is as fast as possible.

    A world that is late by more than 0.1 s does not sprint to catch up: it goes on from there.
    """

    speed: float
    wall_s: float = -math.inf
    world_s: float = 0.0

    def wait_s(self, world_s: float, now_s: float) -> float:
        """Wall seconds until the world may step on from `world_s`; 0 when it may now."""
        if self.speed == 0.0:
            return 0.0
        due_s = self.wall_s + (world_s - self.world_s) / self.speed
        if now_s - due_s > SLIP_S:
            self.wall_s, self.world_s = now_s, world_s
            return 0.0
        return max(0.0, due_s - now_s)


class Leash:
    """The world time not to pass, from lines `until <seconds>`; other lines are ignored."""

    def __init__(self, until_s: float) -> None:
        self.until_s = until_s
        self._rest = b""

    def feed(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            word, _, number = line.decode(errors="replace").partition(" ")
            if word != "until":
                continue
            try:
                self.until_s = max(self.until_s, float(number))
            except ValueError:
                continue
