"""What a GPS receiver reports of a motion, but for noise (pure but for the past it keeps)."""

from collections import deque

from hil.damage.state import GpsDamage
from hil.physics_link import PhysicsState

LONGEST_LAG_S = 10.0
_WHOLE = GpsDamage()


class GpsMeans:
    """Position (m) and velocity (m/s) per NED axis, through the faults that move or hold them.

    A stuck axis keeps position and velocity of the onset.
    """

    def __init__(self) -> None:
        self._frozen: dict[int, tuple[float, float]] = {}  # axis: mean position and velocity
        self._past: deque[PhysicsState] = deque()  # for a receiver that lags

    def at(self, state: PhysicsState, damage: GpsDamage) -> list[tuple[float, float]]:
        """Call it with every state, in order of time."""
        seen = self._lagged(state, damage.lag_s)
        means = list(zip(seen.position_m, seen.velocity_mps, strict=True))
        if damage is _WHOLE or damage == _WHOLE:
            self._frozen.clear()
            return means
        return [self._mean(axis, *means[axis], damage, state.time_s) for axis in range(3)]

    def _lagged(self, state: PhysicsState, lag_s: float) -> PhysicsState:
        """The state that a receiver sees which is that much late."""
        past = self._past
        past.append(state)
        while past[0].time_s < state.time_s - LONGEST_LAG_S - 1e-6:
            past.popleft()
        if lag_s <= 0.0:
            return state
        old = [s for s in past if s.time_s <= state.time_s - lag_s + 1e-6]
        return old[-1] if old else past[0]

    def _mean(
        self, axis: int, m: float, mps: float, damage: GpsDamage, now_s: float
    ) -> tuple[float, float]:
        glitch_mps, drift_mps = damage.glitch_mps[axis], damage.drift_mps[axis]
        m += damage.offset_m[axis]
        m += glitch_mps * (now_s - damage.glitch_since_s)
        m += drift_mps * (now_s - damage.drift_since_s)
        now = (m, mps + glitch_mps)
        if damage.stuck_mask >> axis & 1:
            return self._frozen.setdefault(axis, now)
        self._frozen.pop(axis, None)
        return now
