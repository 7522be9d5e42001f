"""Arming, modes, targets and failsafes: a pure state machine.

Each function takes the state and returns the next one with the answer (a MAV_RESULT) and the texts
that people shall read. Wording and rules follow ArduPilot Rover.
"""

from dataclasses import dataclass, replace

from hil.mavlink import Result, RoverMode, Severity, StatusText, SystemStatus

TARGET_TIMEOUT_S = 3.0
IMPLEMENTED = frozenset({RoverMode.MANUAL, RoverMode.HOLD, RoverMode.GUIDED})


@dataclass(frozen=True, slots=True)
class Target:
    """What GUIDED is to do: drive at a velocity, or to a point (north, east). One of both is set.

    Yaw is a heading in NED (rad), yaw rate in rad/s; None leaves the heading alone.
    """

    time_s: float
    velocity_mps: tuple[float, float] | None = None
    position_m: tuple[float, float] | None = None
    yaw_rad: float | None = None
    yaw_rate_radps: float | None = None


@dataclass(frozen=True, slots=True)
class Autopilot:
    """The discrete state of the autopilot."""

    mode: RoverMode = RoverMode.HOLD
    armed: bool = False
    gcs_lost: bool = False
    target: Target | None = None

    @property
    def drives(self) -> bool:
        """Whether the motors get power at all."""
        return self.armed and self.mode is not RoverMode.HOLD


@dataclass(frozen=True, slots=True)
class Transition:
    """The next state, the answer to who asked, and what people shall read."""

    state: Autopilot
    result: Result = Result.ACCEPTED
    texts: tuple[StatusText, ...] = ()


def arm(state: Autopilot, ready: bool) -> Transition:
    """Arm if the estimator is ready."""
    if state.armed:
        return Transition(state)
    if not ready:
        text = StatusText(Severity.CRITICAL, "Arm: waiting for position estimate")
        return Transition(state, Result.FAILED, (text,))
    text = StatusText(Severity.INFO, "Throttle armed")
    return Transition(replace(state, armed=True, target=None), Result.ACCEPTED, (text,))


def disarm(state: Autopilot) -> Transition:
    """Disarm at once; targets are forgotten."""
    if not state.armed:
        return Transition(state)
    text = StatusText(Severity.INFO, "Throttle disarmed")
    return Transition(replace(state, armed=False, target=None), Result.ACCEPTED, (text,))


def set_mode(state: Autopilot, number: int, ready: bool) -> Transition:
    """Change mode. A mode that is not there, or not possible now, is refused with the reason."""
    try:
        mode = RoverMode(number)
    except ValueError:
        return _refused(state, f"No such mode {number}", Result.DENIED)
    if mode not in IMPLEMENTED:
        return _refused(state, f"Mode {mode.name} is not implemented", Result.UNSUPPORTED)
    if mode is RoverMode.GUIDED and not ready:
        return _refused(state, "Mode GUIDED: waiting for position estimate", Result.FAILED)
    if mode is state.mode:
        return Transition(state)
    return Transition(replace(state, mode=mode, target=None))


def _refused(state: Autopilot, reason: str, result: Result) -> Transition:
    return Transition(state, result, (StatusText(Severity.WARNING, reason),))


def accept_target(state: Autopilot, target: Target) -> Autopilot:
    """Follow a new target; outside GUIDED it is dropped without a word, as ArduPilot does."""
    return replace(state, target=target) if state.mode is RoverMode.GUIDED else state


def check_target(state: Autopilot, now_s: float) -> Transition:
    """Forget a velocity that nobody has repeated for 3 s. A position stays."""
    target = state.target
    if target is None or target.position_m is not None:
        return Transition(state)
    if now_s - target.time_s <= TARGET_TIMEOUT_S:
        return Transition(state)
    text = StatusText(Severity.WARNING, "target not received last 3secs, stopping")
    return Transition(replace(state, target=None), texts=(text,) if state.armed else ())


def check_gcs(state: Autopilot, silence_s: float | None, timeout_s: float) -> Transition:
    """HOLD when an armed vehicle has not heard its station for longer than the time-out.

    `silence_s` is the time since the last heartbeat; None while there is nothing to miss.
    A heartbeat clears the failsafe but not the HOLD.
    """
    lost = silence_s is not None and silence_s > timeout_s
    if lost == state.gcs_lost:
        return Transition(state)
    if not lost:
        text = StatusText(Severity.INFO, "GCS Failsafe Cleared")
        return Transition(replace(state, gcs_lost=False), texts=(text,))
    if not state.armed:
        return Transition(state)
    text = StatusText(Severity.WARNING, "GCS Failsafe: Hold")
    held = replace(state, gcs_lost=True, mode=RoverMode.HOLD, target=None)
    return Transition(held, texts=(text,))


def system_status(state: Autopilot, ready: bool) -> SystemStatus:
    """MAV_STATE for the heartbeat."""
    if state.gcs_lost:
        return SystemStatus.CRITICAL
    if state.armed:
        return SystemStatus.ACTIVE
    return SystemStatus.STANDBY if ready else SystemStatus.CALIBRATING
