"""What a receiver says beside what its estimator makes of it (pure).

An estimator that has an accelerometer swings between that and a receiver that is stuck or jumps, in
a way that no twin has; so where fixes count, a suspect is judged by them, not by the estimate. The
estimate moves with the vehicle even when its receiver does not: a fix that stands while the
estimate goes somewhere is stuck, whatever the motors do. That, and an estimator that says it has
lost its position, is the firmware's own word. It counts once for each experiment, however long that
takes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from base_station.belief.hypotheses import UNKNOWN, Hypothesis
from base_station.receiving.telemetry import Frame
from hil.faults import NED_AXES, Type, Unit

Array = NDArray[np.float64]

MOVED_M = 0.12  # a report that spans so much has moved: at rest it wanders over half of that
STILL_M = 0.03  # a fix that spans less has not; its last digit is 1 cm
UNHEARD_OF = math.log(1e-3)  # that it says so under another fault


def has_fix(frame: Frame, vehicle: int) -> bool:
    """Whether the frame has a fix of the vehicle that counts."""
    return frame.receivers is not None and bool(np.isfinite(frame.receivers.fix_s[vehicle]))


def seen_m(frame: Frame, vehicle: int) -> Array:
    """[V, 2] positions of the frame; of that vehicle its fix, where it has one that counts."""
    if frame.receivers is None or not has_fix(frame, vehicle):
        return frame.position_m
    position_m = frame.position_m.copy()
    position_m[vehicle] = frame.receivers.fix_m[vehicle]
    return position_m


def seen_s(frame: Frame, vehicle: int) -> float:
    """When the vehicle was where `seen_m` has it."""
    if frame.receivers is None or not has_fix(frame, vehicle):
        return frame.time_s
    return float(frame.receivers.fix_s[vehicle])


@dataclass(frozen=True, eq=False)
class Fixes:
    """What reports and fixes have spanned since the last anchor: lowest and highest, [2, 2]."""

    report_m: Array
    fix_m: Array
    lost: bool = False

    @classmethod
    def none(cls) -> Self:
        return cls(_nothing(), _nothing())

    def heard(self, frame: Frame, vehicle: int) -> "Fixes":
        """What one more frame says of the vehicle."""
        told = frame.receivers
        if told is None:
            return self
        return self.noted(frame.position_m[vehicle], told.fix_m[vehicle], bool(told.lost[vehicle]))

    def noted(self, report_m: Array, fix_m: Array, lost: bool) -> "Fixes":
        """One more report and fix [2], north and east; NaN: there is none."""
        return replace(
            self,
            report_m=_wider(self.report_m, report_m),
            fix_m=_wider(self.fix_m, fix_m),
            lost=self.lost or lost,
        )

    def log_likelihood(self, hypotheses: Sequence[Hypothesis]) -> Array:
        """[H] of all that was heard."""
        return np.array([self._of(h) for h in hypotheses])

    def _of(self, hypothesis: Hypothesis) -> float:
        if not np.isfinite(self.fix_m).all():
            return 0.0
        of_gps = hypothesis.fault is not None and hypothesis.fault.unit is Unit.GPS
        said = UNHEARD_OF if self.lost and not of_gps else 0.0
        for k, axis in enumerate(NED_AXES[:2]):
            moved, still = (x[1, k] - x[0, k] for x in (self.report_m, self.fix_m))
            if moved > MOVED_M and (still < STILL_M) != _is_stuck(hypothesis, axis):
                said += UNHEARD_OF
        return 0.5 * said if hypothesis.name == UNKNOWN else said


def _is_stuck(hypothesis: Hypothesis, axis: str) -> bool:
    fault = hypothesis.fault
    if fault is None or hypothesis.kind != (Unit.GPS, Type.STUCK):
        return False
    return not fault.axes or axis in fault.axes


def _nothing() -> Array:
    return np.array([[np.inf, np.inf], [-np.inf, -np.inf]])


def _wider(span: Array, value: Array) -> Array:
    return np.stack([np.fmin(span[0], value), np.fmax(span[1], value)])
