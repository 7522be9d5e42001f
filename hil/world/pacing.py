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


@dataclass
class Leash:
    """The world time not to pass; it only ever gets longer."""

    until_s: float

    def lengthen(self, until_s: float) -> None:
        """A time that is no number leaves it as it is."""
        if until_s > self.until_s:
            self.until_s = until_s
