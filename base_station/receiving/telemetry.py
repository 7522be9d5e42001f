"""What has been received: per-vehicle history, and the fleet on a common time base."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np
from numpy.typing import NDArray

from hil import mavlink
from hil.airframe import pwm_to_output

Array = NDArray[np.float64]

MAX_AGE_S = 0.35  # older than this a sample is not carried forward to a frame
HISTORY = 64
ROUND_TRIPS = 20
MIDDLE_80 = 2.563  # standard deviations wide
LOSS_WINDOW_S = 5.0
MISSED = 0.01  # the chance that is left of missing all copies of an order
SPREAD = 3.0  # standard deviations of the round trip until it is surely obeyed


@dataclass(frozen=True)
class Sample:
    """LOCAL_POSITION_NED at fleet time: north and east (m, m/s)."""

    time_s: float
    position_m: tuple[float, float]
    velocity_mps: tuple[float, float]


@dataclass(frozen=True)
class Fix:
    """GPS_RAW_INT: where its antenna was at fleet time; north and east (m)."""

    time_s: float
    position_m: tuple[float, float]


@dataclass(frozen=True)
class Status:
    """The slow things a vehicle says of itself."""

    heard: bool = False
    armed: bool = False
    mode: int = -1
    mode_beats: int = 0  # heartbeats in a row that have said so
    yaw_rad: float = float("nan")
    motor_outputs: tuple[float, ...] = ()
    battery_percent: float = float("nan")
    gps_satellites: int = 0
    sticks_us: tuple[int, ...] = ()  # RC_CHANNELS 1 to 4, where a pilot has a transmitter
    gps_fix: int = 0  # GPS_FIX_TYPE
    ekf_flags: int = 0  # EKF_STATUS_FLAGS
    prearm_ok: bool = False  # SYS_STATUS


@dataclass(frozen=True, eq=False)
class Receivers:
    """What the receivers of a fleet say beside what its estimators make of it."""

    fix_m: Array  # [V, 2] north, east; NaN where there is none, or none that counts
    fix_s: Array  # [V] fleet time at which the vehicle was there
    lost: NDArray[np.bool_]  # [V] the estimator says that it has no position


@dataclass(frozen=True)
class Frame:
    """The fleet at one instant of fleet time. Rows in fleet order; stale rows are NaN."""

    time_s: float
    position_m: Array  # [V, 2] north, east
    velocity_mps: Array  # [V, 2]
    yaw_rad: Array  # [V]
    fresh: NDArray[np.bool_]  # [V]
    came: NDArray[np.bool_]  # [V] whether the report of this very time has come
    loss: Array  # [V] share of reports that got lost lately
    delay_s: Array  # [V] from here until orders that answer it take effect, usually
    jitter_s: Array  # [V] standard deviation of that
    driven: NDArray[np.bool_]  # [V] since the frame before it was in a mode that takes set-points
    receivers: Receivers | None = None  # where they count

    @property
    def all_stand(self) -> bool:
        """Everybody is heard and in HOLD: told to, and known to have done so."""
        return bool(self.fresh.all() and not self.driven.any())


class Track:
    """One vehicle's history. Ordered by vehicle time: late and doubled packets change nothing."""

    def __init__(self) -> None:
        self.status = Status()
        self.samples: deque[Sample] = deque(maxlen=HISTORY)
        self.fixes: deque[Fix] = deque(maxlen=HISTORY)
        self.last_heard_wall_s = float("-inf")
        self._round_trips_s: deque[float] = deque(maxlen=ROUND_TRIPS)
        self._modes: deque[tuple[float, int]] = deque(maxlen=HISTORY)

    def said(self, status: Status) -> None:
        """A new status, at the time of the newest sample."""
        if status.mode != self.status.mode:
            self._modes.append((self.newest_s(), status.mode))
        self.status = status

    def mode_at(self, time_s: float) -> int:
        """The mode it was in after the sample of `time_s`."""
        known = [mode for since_s, mode in self._modes if since_s <= time_s + 1e-3]
        return known[-1] if known else self.status.mode

    def answered(self, round_trip_s: float) -> None:
        """A question took so long, in fleet time: from a report until what answers it is there."""
        if math.isfinite(round_trip_s):
            self._round_trips_s.append(max(0.0, round_trip_s))

    @property
    def round_trip_s(self) -> float:
        """Its median; 0 while nothing is known."""
        return median(self._round_trips_s) if self._round_trips_s else 0.0

    @property
    def jitter_s(self) -> float:
        """Its standard deviation, from the middle 80 %: a single outlier is no link."""
        if not self._round_trips_s:
            return 0.0
        low_s, high_s = np.quantile(self._round_trips_s, (0.1, 0.9))
        return float(high_s - low_s) / MIDDLE_80

    def obeyed_within_s(self, time_s: float, period_s: float) -> float:
        """How long it takes, from a report, until what answers it each period is surely obeyed."""
        loss = min(self.loss(time_s, period_s), 0.9)
        copies = math.log(MISSED) / math.log(loss) - 1.0 if loss > MISSED else 0.0
        return self.round_trip_s + SPREAD * self.jitter_s + copies * period_s

    def position(self, sample: Sample) -> None:
        if not self.samples or sample.time_s > self.samples[-1].time_s:
            self.samples.append(sample)

    def at(self, time_s: float) -> Sample | None:
        """The newest sample not after `time_s` (1 ms slack), carried forward; None when stale."""
        for sample in reversed(self.samples):
            age_s = time_s - sample.time_s
            if age_s >= -1e-3:
                if age_s > MAX_AGE_S:
                    return None
                return replace(
                    sample,
                    position_m=(
                        sample.position_m[0] + age_s * sample.velocity_mps[0],
                        sample.position_m[1] + age_s * sample.velocity_mps[1],
                    ),
                )
        return None

    def fix(self, fix: Fix) -> None:
        if not self.fixes or fix.time_s > self.fixes[-1].time_s:
            self.fixes.append(fix)

    def fix_at(self, time_s: float) -> Fix | None:
        """The newest fix not after `time_s`, however old."""
        return next((f for f in reversed(self.fixes) if f.time_s <= time_s + 1e-3), None)

    def has(self, time_s: float, within_s: float) -> bool:
        """Whether there is a sample of about that time."""
        return any(abs(sample.time_s - time_s) <= within_s for sample in reversed(self.samples))

    def loss(self, time_s: float, period_s: float) -> float:
        """Share of the reports of the last LOSS_WINDOW_S before `time_s` that are missing."""
        since_s = max(time_s - LOSS_WINDOW_S, self.samples[0].time_s if self.samples else time_s)
        due = round((time_s - since_s) / period_s)
        came = sum(since_s + 1e-3 < s.time_s <= time_s + 1e-3 for s in self.samples)
        return max(0.0, 1.0 - came / due) if due else 0.0

    def newest_s(self) -> float:
        return self.samples[-1].time_s if self.samples else float("-inf")


def note(status: Status, value: object, motors: int) -> Status:
    """Status after one more message; messages that say nothing of it change nothing."""
    match value:
        case mavlink.Heartbeat():
            mode = value.custom_mode
            beats = status.mode_beats + 1 if mode == status.mode else 1
            return replace(status, heard=True, armed=value.armed, mode=mode, mode_beats=beats)
        case mavlink.Attitude():
            return replace(status, yaw_rad=value.yaw_rad)
        case mavlink.ServoOutputs():
            outputs = tuple(pwm_to_output(p) or 0.0 for p in value.pwm_us[:motors])
            return replace(status, motor_outputs=outputs)
        case mavlink.Battery():
            return replace(status, battery_percent=value.remaining_percent)
        case mavlink.GpsRaw():
            return replace(
                status,
                gps_satellites=value.satellites,
                gps_fix=value.fix_type,
            )
        case mavlink.RcChannels():
            return replace(status, sticks_us=value.channels_us[:4])
        case mavlink.EkfStatus():
            return replace(status, ekf_flags=value.flags)
        case mavlink.SysStatus():
            return replace(status, prearm_ok=bool(value.health & mavlink.Sensor.PREARM_CHECK))
        case _:
            return status


def frame_at(
    tracks: list[Track],
    time_s: float,
    period_s: float,
    newest_s: float,
    driven: Sequence[bool],
) -> Frame:
    """The whole fleet at `time_s`, each vehicle from its newest sample by then.

    `newest_s`: what has come by now; orders that answer this frame are sent no earlier.
    """
    rows = [t.at(time_s) for t in tracks]
    nan2 = (float("nan"), float("nan"))
    return Frame(
        time_s,
        np.array([r.position_m if r else nan2 for r in rows]),
        np.array([r.velocity_mps if r else nan2 for r in rows]),
        np.array([t.status.yaw_rad for t in tracks]),
        np.array([r is not None for r in rows]),
        np.array([t.has(time_s, period_s / 2) for t in tracks]),
        np.array([t.loss(time_s, period_s) for t in tracks]),
        np.array([newest_s - time_s + t.round_trip_s for t in tracks]),
        np.array([t.jitter_s for t in tracks]),
        np.array(driven),
    )
