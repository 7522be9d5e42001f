"""One finished run: a row of the campaign's table (pure)."""

from dataclasses import dataclass, field, fields
from typing import Any

from hil.bench.labels import CANNOT_TELL, NO_ALARM, NONE, WRONG_VEHICLE


@dataclass(frozen=True)
class Row:
    """Times are simulation time (s), impulses N s; None where there is no such thing.

    `truth` is the name of what had really struck when the run ended, `meant` of all that was to
    strike. `posterior`, `prior` and `looks` (by time after the alarm) are about `suspect`, whose
    own truth is `suspect_truth`. Two runs of one spec differ in `TIMINGS` only.
    """

    key: str
    point: dict[str, str]
    layout: int
    repeat: int
    seed: int
    meant: str
    truth: str = NONE
    suspect: int | None = None
    suspect_truth: str = NONE
    hypothesis: str | None = None
    decided: bool = False
    posterior: dict[str, float] = field(default_factory=dict)
    prior: dict[str, float] = field(default_factory=dict)
    looks: dict[str, dict[str, float]] = field(default_factory=dict)
    onset_s: float | None = None
    alarm_s: float | None = None  # the first that was no false alarm
    verdict_s: float | None = None
    false_alarms: int = 0
    false_alarm_sysids: tuple[int, ...] = ()
    healthy_vehicle_s: float = 0.0  # of vehicles before a fault of their own
    vehicle_s: float = 0.0
    fleet_s: float = 0.0
    ended: str = ""
    experiments: int = 0
    contacts: int = 0
    contact_max_ns: float = 0.0
    contact_sum_ns: float = 0.0
    wall_max_ns: float = 0.0
    error: str = ""
    wall_s: float = 0.0
    cpu_s: float = 0.0
    planning_cpu_s: float = 0.0

    @property
    def failed(self) -> bool:
        """The program failed, not the station."""
        return bool(self.error)

    @property
    def alarmed(self) -> bool:
        return self.alarm_s is not None or self.false_alarms > 0

    @property
    def said(self) -> str:
        """The column of the confusion matrix."""
        if not self.alarmed and self.hypothesis is None:
            return NO_ALARM
        if not self.decided or self.hypothesis is None:
            return CANNOT_TELL
        if self.truth != NONE and self.suspect_truth == NONE and self.hypothesis != NONE:
            return WRONG_VEHICLE
        return self.hypothesis

    @property
    def correct(self) -> bool:
        """A healthy fleet is rightly left alone, or cleared; a broken one needs the right name."""
        if self.said == NO_ALARM:
            return self.truth == NONE
        return self.decided and self.hypothesis == self.suspect_truth == self.truth

    @property
    def wrong(self) -> bool:
        """Decided, and not right. 'Cannot tell' and a fault that raised no alarm are not this."""
        return self.decided and not self.correct

    @property
    def delay_s(self) -> float | None:
        """From the onset to the alarm, for faults that struck a fleet under way."""
        abrupt = self.onset_s is not None and self.onset_s > 0.0
        return None if not abrupt or self.alarm_s is None else self.alarm_s - (self.onset_s or 0.0)

    @property
    def judging_s(self) -> float | None:
        """From the alarm to the verdict."""
        if self.verdict_s is None or self.alarm_s is None:
            return None
        return self.verdict_s - self.alarm_s

    def tree(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    @classmethod
    def of_tree(cls, tree: dict[str, Any]) -> "Row":
        """The inverse. Raises TypeError, KeyError."""
        return cls(**{**tree, "false_alarm_sysids": tuple(tree["false_alarm_sysids"])})


TIMINGS = ("wall_s", "cpu_s", "planning_cpu_s")
