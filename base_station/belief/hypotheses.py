"""What could be wrong with a suspect: candidate faults with priors, 'none' and 'unknown' too."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hil.faults import NED_AXES, Fault, Type, Unit
from hil.scenario import FleetMember, Priors

NONE = "none"
UNKNOWN = "unknown"


@dataclass(frozen=True)
class Hypothesis:
    """A fault with a prior. 'none' and 'unknown' carry no fault; 'unknown' has no twin either.

    A candidate's fault has no size yet where its type needs one (`SIZES`): it is to be estimated.
    """

    name: str
    sysid: int
    prior: float
    fault: Fault | None = None

    @property
    def has_twin(self) -> bool:
        return self.name != UNKNOWN

    @property
    def kind(self) -> tuple[Unit, Type] | None:
        return (self.fault.unit, self.fault.type) if self.fault else None

    def sized(self, *size: float) -> "Hypothesis":
        """The same with a size for its fault."""
        assert self.fault is not None
        return replace(self, fault=replace(self.fault, size=tuple(size)))


# share of its family's prior that a type has; the axes of a type share it
MOTOR_SHARES = {Type.OFF: 0.7, Type.PARTIAL: 0.2, Type.REVERSED: 0.1}
GPS_SHARES = {
    Type.STUCK: 0.6,
    Type.OFFSET: 0.15,
    Type.DRIFT: 0.1,
    Type.NOISE: 0.075,
    Type.DELAY: 0.075,
}

# sizes that are drawn and weighed; those of a jump or a drift are estimated by the filter instead
SIZES = {
    (Unit.MOTOR, Type.PARTIAL): (0.3, 0.9),
    (Unit.GPS, Type.NOISE): (0.1, 1.5),
    (Unit.GPS, Type.DELAY): (0.2, 1.4),
}


def nominal(sysid: int) -> Hypothesis:
    """Nothing is wrong: the hypothesis under which the fleet is watched."""
    return Hypothesis(NONE, sysid, 1.0)


def candidates(member: FleetMember, priors: Priors) -> tuple[Hypothesis, ...]:
    """Every explanation this station knows for a vehicle that does not answer as it should.

    The motors of a body axis off, weak or reversed; GPS stuck (a horizontal NED axis or all), off
    by a constant, drifting, noisy or late; nothing wrong after all; and something else. Priors of a
    family are shared out over types and axes, and sum to 1.
    """
    weighted: list[tuple[str, Fault | None, float]] = [
        *_weighted(_motor_faults(member), priors.motor, MOTOR_SHARES),
        *_weighted(_gps_faults(), priors.gps, GPS_SHARES),
        (NONE, None, priors.none),
        (UNKNOWN, None, priors.unknown),
    ]
    total = float(np.sum([w for _, _, w in weighted]))
    return tuple(Hypothesis(n, member.sysid, w / total, f) for n, f, w in weighted)


def _motor_faults(member: FleetMember) -> Iterator[tuple[str, Fault]]:
    for axis in ("x", "y"):
        motors = member.frame.axis_motors(axis)
        for kind in MOTOR_SHARES if motors else ():
            yield f"motor_{axis}_{kind}", Fault(Unit.MOTOR, kind, motors)


def _gps_faults() -> Iterator[tuple[str, Fault]]:
    for axis in NED_AXES[:2]:
        yield f"gps_{axis}_stuck", Fault(Unit.GPS, Type.STUCK, axes=(axis,))
    for kind in GPS_SHARES:
        yield f"gps_{kind}", Fault(Unit.GPS, kind)


def _weighted(
    faults: Iterator[tuple[str, Fault]], prior: float, shares: dict[Type, float]
) -> list[tuple[str, Fault | None, float]]:
    named = list(faults)
    of_type = {kind: sum(f.type is kind for _, f in named) for kind in shares}
    return [(name, f, prior * shares[f.type] / of_type[f.type]) for name, f in named]
