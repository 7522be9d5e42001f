"""Arming, modes, targets and failsafes: a pure state machine.

Each function takes the state and returns the next one with the answer (a MAV_RESULT) and the texts
that people shall read. Wording and rules follow ArduPilot Rover.
"""

from dataclasses import dataclass, replace
from enum import Enum

from hil.mavlink import Result, RoverMode, Severity, StatusText, SystemStatus

TARGET_TIMEOUT_S = 3.0
IMPLEMENTED = frozenset(
    {RoverMode.MANUAL, RoverMode.HOLD, RoverMode.GUIDED, RoverMode.AUTO, RoverMode.RTL}
)
NEED_POSITION = frozenset({RoverMode.GUIDED, RoverMode.AUTO, RoverMode.RTL})


class Failsafe(Enum):
    """What can trip, by the name that people read."""

    GCS = "GCS Failsafe"
    GPS = "GPS Failsafe"
    BATTERY_LOW = "Battery Failsafe"
    BATTERY_CRITICAL = "Critical Battery Failsafe"
    FENCE = "Fence Breach"


@dataclass(frozen=True, slots=True)
class Target:
    """Where to drive: at a velocity, or to a point (north, east). One of both is set.

    Yaw is a heading in NED (rad), yaw rate in rad/s; None leaves the heading alone. A point may
    come with a speed not to exceed. What flies also climbs at `down_mps`, or goes to the height
    `down_m` (both NED down), and may be told to leave the ground or to come down to it. `then` is
    what came while it was leaving the ground: it waits until the height is reached.
    """

    time_s: float
    velocity_mps: tuple[float, float] | None = None
    position_m: tuple[float, float] | None = None
    yaw_rad: float | None = None
    yaw_rate_radps: float | None = None
    speed_mps: float | None = None
    down_mps: float = 0.0
    down_m: float | None = None
    lifts: bool = False
    lands: bool = False
    then: "Target | None" = None


@dataclass(frozen=True, slots=True)
class Autopilot:
    """The discrete state of the autopilot."""

    mode: RoverMode = RoverMode.HOLD
    armed: bool = False
    tripped: frozenset[Failsafe] = frozenset()
    target: Target | None = None

    @property
    def drives(self) -> bool:
        """Whether the motors get power at all."""
        return self.armed and self.mode is not RoverMode.HOLD


@dataclass(frozen=True, slots=True)
class Readiness:
    """What transitions depend on: a position estimate, a mission, and complaints against arming.

    What flies has two more: it stands on the ground and its mission does not begin with a take-off
    (`grounded`), and the throttle stick is not at the bottom (`throttle_up`).
    """

    position: bool
    mission: bool = False
    complaints: tuple[str, ...] = ()
    grounded: bool = False
    throttle_up: bool = False

    @property
    def to_arm(self) -> bool:
        return self.position and not self.complaints


@dataclass(frozen=True, slots=True)
class Transition:
    """The next state, the answer to who asked, and what people shall read."""

    state: Autopilot
    result: Result = Result.ACCEPTED
    texts: tuple[StatusText, ...] = ()


def arm(state: Autopilot, ready: Readiness) -> Transition:
    """Arm if nothing speaks against it; otherwise every reason is told."""
    if state.armed:
        return Transition(state)
    reasons = _against_arming(state, ready)
    if reasons:
        texts = tuple(StatusText(Severity.CRITICAL, f"Arm: {reason}") for reason in reasons)
        return Transition(state, Result.FAILED, texts)
    text = StatusText(Severity.INFO, "Throttle armed")
    return Transition(replace(state, armed=True, target=None), Result.ACCEPTED, (text,))


def _against_arming(state: Autopilot, ready: Readiness) -> tuple[str, ...]:
    waiting = () if ready.position else ("waiting for position estimate",)
    grounded = ready.grounded and state.mode is RoverMode.AUTO
    high = ready.throttle_up and state.mode is RoverMode.MANUAL
    return (
        *waiting,
        *ready.complaints,
        *(("Missing Takeoff Cmd",) if grounded else ()),
        *(("Throttle too high",) if high else ()),
    )


def disarm(state: Autopilot) -> Transition:
    """Disarm at once; targets are forgotten."""
    if not state.armed:
        return Transition(state)
    text = StatusText(Severity.INFO, "Throttle disarmed")
    return Transition(replace(state, armed=False, target=None), Result.ACCEPTED, (text,))


def set_mode(state: Autopilot, number: int, ready: Readiness) -> Transition:
    """Change mode. A mode that is not there, or not possible now, is refused with the reason."""
    try:
        mode = RoverMode(number)
    except ValueError:
        return _refused(state, f"No such mode {number}", Result.DENIED)
    if mode not in IMPLEMENTED:
        return _refused(state, f"Mode {mode.name} is not implemented", Result.UNSUPPORTED)
    if mode is state.mode:
        return Transition(state)
    if mode in NEED_POSITION and (not ready.position or Failsafe.GPS in state.tripped):
        return _refused(state, f"Mode {mode.name}: waiting for position estimate", Result.FAILED)
    if mode is RoverMode.AUTO and not ready.mission:
        return _refused(state, "Mode AUTO: no mission", Result.FAILED)
    if mode is RoverMode.AUTO and state.armed and ready.grounded:
        return _refused(state, "Auto: Missing Takeoff Cmd", Result.FAILED)
    return Transition(replace(state, mode=mode, target=None))


def _refused(state: Autopilot, reason: str, result: Result) -> Transition:
    return Transition(state, result, (StatusText(Severity.WARNING, reason),))


def accept_target(state: Autopilot, target: Target) -> Autopilot:
    """Follow a new target; outside GUIDED it is dropped without a word, as ArduPilot does.

    A take-off is brought to its end first, so that a set-point can't stop a climb at half height;
    in ArduPilot Copter it would. The newest one waits.
    """
    if state.mode is not RoverMode.GUIDED:
        return state
    if state.target is not None and state.target.lifts and not target.lifts:
        return replace(state, target=replace(state.target, then=target))
    return replace(state, target=target)


def end_climb(state: Autopilot, now_s: float) -> Autopilot:
    """The height of a take-off is reached: follow what has waited, unless it is stale, or hover."""
    if state.mode is not RoverMode.GUIDED or state.target is None or not state.target.lifts:
        return state
    hover = replace(state.target, lifts=False, then=None)
    waited = replace(state, target=state.target.then or hover)
    return replace(state, target=hover) if _is_stale(waited.target, now_s) else waited


def _is_stale(target: Target | None, now_s: float) -> bool:
    """A velocity that nobody has repeated for 3 s. A position stays."""
    if target is None or target.position_m is not None:
        return False
    return now_s - target.time_s > TARGET_TIMEOUT_S


def check_target(state: Autopilot, now_s: float) -> Transition:
    """Forget a velocity that nobody has repeated for 3 s. A position stays."""
    if not _is_stale(state.target, now_s):
        return Transition(state)
    text = StatusText(Severity.WARNING, "target not received last 3secs, stopping")
    return Transition(replace(state, target=None), texts=(text,) if state.armed else ())


def check(
    state: Autopilot, which: Failsafe, tripped: bool, action: RoverMode | None, flies: bool = False
) -> Transition:
    """Trip a failsafe of an armed vehicle, or clear it. What flies lands where others hold.

    It acts once, when it trips: `action` is the mode to go to, None only reports. Clearing does not
    bring the old mode back.
    """
    if tripped == (which in state.tripped):
        return Transition(state)
    if not tripped:
        text = StatusText(Severity.INFO, f"{which.value} Cleared")
        return Transition(replace(state, tripped=state.tripped - {which}), texts=(text,))
    if not state.armed:
        return Transition(state)
    does = "Report" if action is None else action.name.capitalize()
    if flies and action is RoverMode.HOLD:
        does = "Land"
    text = StatusText(Severity.WARNING, f"{which.value}: {does}")
    state = replace(state, tripped=state.tripped | {which})
    if action is not None and action is not state.mode:
        state = replace(state, mode=action, target=None)
    return Transition(state, texts=(text,))


def check_sticks(state: Autopilot, released: bool, flies: bool = False) -> Transition:
    """HOLD when whoever drove in MANUAL has let go. What flies lands."""
    if not released or not state.armed or state.mode is not RoverMode.MANUAL:
        return Transition(state)
    text = StatusText(Severity.WARNING, f"Radio Failsafe: {'Land' if flies else 'Hold'}")
    return Transition(replace(state, mode=RoverMode.HOLD, target=None), texts=(text,))


def system_status(state: Autopilot, ready: bool) -> SystemStatus:
    """MAV_STATE for the heartbeat."""
    if state.tripped:
        return SystemStatus.CRITICAL
    if state.armed:
        return SystemStatus.ACTIVE
    return SystemStatus.STANDBY if ready else SystemStatus.CALIBRATING
