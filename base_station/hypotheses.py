"""What could be wrong with a suspect: candidate faults with priors, 'none' and 'unknown' too."""

from dataclasses import dataclass

import numpy as np

from hil.faults import Fault, Type, Unit
from hil.scenario import FleetMember, Priors

NONE = "none"
UNKNOWN = "unknown"


@dataclass(frozen=True)
class Hypothesis:
    """A fault with a prior. 'none' and 'unknown' carry no fault; 'unknown' has no twin either."""

    name: str
    sysid: int
    prior: float
    fault: Fault | None = None

    @property
    def has_twin(self) -> bool:
        return self.name != UNKNOWN


def nominal(sysid: int) -> Hypothesis:
    """Nothing is wrong: the hypothesis under which the fleet is watched."""
    return Hypothesis(NONE, sysid, 1.0)


def candidates(member: FleetMember, priors: Priors) -> tuple[Hypothesis, ...]:
    """Every explanation this station knows for a vehicle that does not answer as it should.

    One motor pair off per body axis, one GPS axis stuck per horizontal NED axis, nothing wrong
    after all, and something else. Priors of a family are shared out evenly and sum to 1.
    """
    motors = [
        (f"motor_{axis}_off", Fault(Unit.MOTOR, Type.OFF, member.frame.axis_motors(axis)))
        for axis in ("x", "y")
        if member.frame.axis_motors(axis)
    ]
    gps = [
        (f"gps_{axis}_stuck", Fault(Unit.GPS, Type.STUCK, axes=(axis,)))
        for axis in ("north", "east")
    ]
    weighted: list[tuple[str, Fault | None, float]] = [
        *((name, fault, priors.motor / len(motors)) for name, fault in motors),
        *((name, fault, priors.gps / len(gps)) for name, fault in gps),
        (NONE, None, priors.none),
        (UNKNOWN, None, priors.unknown),
    ]
    total = float(np.sum([w for _, _, w in weighted]))
    return tuple(Hypothesis(n, member.sysid, w / total, f) for n, f, w in weighted)
