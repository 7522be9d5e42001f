"""Every kind of fault there is: its effect in truth and in telemetry, and that both are restored.

Each fault meets the same drive beside a sound vehicle with the same noise: north, south and rest.
What differs is the fault. A kind without a line in `SHOWS` fails.
"""

import itertools
import math
import statistics
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from fault_vocabulary import EXAMPLES
from vehicle_world import InWorld, Velocity, scenario

from hil.faults import KINDS, Fault, Type, Unit, to_clearing, to_injection
from hil.mavlink import (
    Attitude,
    EscTelemetry,
    FixType,
    GpsRaw,
    LocalPosition,
    MessageId,
    RawImu,
)

NORTH: Velocity = (0.5, 0.2, 0.0)
SOUTH: Velocity = (-0.5, -0.2, 0.0)
REST: Velocity = (0.0, 0.0, 0.0)
ASKED = (
    MessageId.GPS_RAW_INT,
    MessageId.RAW_IMU,
    MessageId.ESC_TELEMETRY_1_TO_4,
    MessageId.ATTITUDE,
)

Measure = Callable[["Drive", "Drive"], float]


@dataclass(frozen=True)
class Drive:
    """What was true and what was told during one drive, each at the same times."""

    truth: list[tuple[float, float, float]]  # north, east, yaw at each tick of 0.1 s
    reports: list[LocalPosition]
    fixes: list[GpsRaw]
    samples: list[RawImu]
    escs: list[EscTelemetry]
    attitudes: list[Attitude]


def astray_m(sound: Drive, broken: Drive) -> float:
    """How far from where it should have been, at most."""
    pairs = zip(sound.truth, broken.truth, strict=True)
    return max(math.dist(a[:2], b[:2]) for a, b in pairs)


def turned_rad(sound: Drive, broken: Drive) -> float:
    return max(abs(a[2] - b[2]) for a, b in zip(sound.truth, broken.truth, strict=True))


def _gaps_m(drive: Drive) -> list[float]:
    pairs = zip(drive.truth, drive.reports, strict=True)
    return [math.dist(t[:2], r.position_m[:2]) for t, r in pairs]


def misplaced_m(sound: Drive, broken: Drive) -> float:
    """Reported less true position, at most; beyond what a sound vehicle has."""
    return max(_gaps_m(broken)) - max(_gaps_m(sound))


def told_m(sound: Drive, broken: Drive) -> float:
    """How different what is reported is."""
    pairs = zip(sound.reports, broken.reports, strict=True)
    return max(math.dist(a.position_m[:2], b.position_m[:2]) for a, b in pairs)


def unfixed(_sound: Drive, broken: Drive) -> float:
    """Share of GPS_RAW_INT that says that there is no fix."""
    return statistics.mean(f.fix_type == FixType.NO_FIX for f in broken.fixes)


def repeated(_sound: Drive, broken: Drive) -> float:
    """Share of fixes that are the one before to the digit."""
    places = [(f.lat_deg, f.lon_deg, f.speed_mps) for f in broken.fixes]
    return statistics.mean(a == b for a, b in itertools.pairwise(places))


def scatter_m(sound: Drive, broken: Drive) -> float:
    """Change from fix to fix, beyond what a sound receiver has."""

    def spread(drive: Drive) -> float:
        lats = [math.radians(f.lat_deg) * 6_378_137.0 for f in drive.fixes]
        return statistics.stdev(b - a for a, b in itertools.pairwise(lats))

    return spread(broken) - spread(sound)


def rate_radps(sound: Drive, broken: Drive) -> float:
    """Largest difference of the yaw rate told."""
    pairs = zip(sound.attitudes, broken.attitudes, strict=True)
    return max(abs(a.yaw_rate_radps - b.yaw_rate_radps) for a, b in pairs)


def force_mps2(sound: Drive, broken: Drive) -> float:
    """Largest difference of the forward acceleration told."""
    pairs = zip(sound.samples, broken.samples, strict=True)
    return max(abs(a.accel_mps2[0] - b.accel_mps2[0]) for a, b in pairs)


def revolutions(sound: Drive, broken: Drive) -> float:
    """Largest difference of what the first speed controller tells, rpm."""
    pairs = zip(sound.escs, broken.escs, strict=True)
    return max(float(abs(a.escs[0].rpm - b.escs[0].rpm)) for a, b in pairs)


@dataclass(frozen=True)
class Shows:
    """A measure in truth and one in telemetry, with what the fault makes of them at least.

    `true_least` of None: nothing may change in truth.
    """

    true: Measure
    true_least: float | None
    told: Measure
    told_least: float


MOVES = Shows(astray_m, 0.3, told_m, 0.3)  # it goes elsewhere, and says so
LIES = Shows(astray_m, 0.1, misplaced_m, 0.3)  # it says what is not, and acts on it

SHOWS: dict[tuple[Unit, Type], Shows] = {
    (Unit.MOTOR, Type.OFF): MOVES,
    (Unit.MOTOR, Type.LOCKED): MOVES,
    (Unit.MOTOR, Type.PARTIAL): MOVES,
    (Unit.MOTOR, Type.REVERSED): MOVES,
    (Unit.MOTOR, Type.STUCK): MOVES,
    (Unit.MOTOR, Type.INTERMITTENT): MOVES,
    (Unit.ESC, Type.OFF): Shows(astray_m, None, revolutions, 500.0),
    (Unit.ESC, Type.WRONG): Shows(astray_m, None, revolutions, 500.0),
    (Unit.GPS, Type.OFF): Shows(astray_m, 0.3, unfixed, 0.6),
    (Unit.GPS, Type.STUCK): LIES,
    (Unit.GPS, Type.REPEAT): Shows(astray_m, 0.1, repeated, 0.95),
    (Unit.GPS, Type.OFFSET): Shows(astray_m, 0.05, misplaced_m, 2.0),
    (Unit.GPS, Type.GLITCH): LIES,
    (Unit.GPS, Type.DRIFT): Shows(astray_m, 0.05, misplaced_m, 0.5),
    (Unit.GPS, Type.NOISE): Shows(astray_m, 0.02, scatter_m, 1.0),
    (Unit.GPS, Type.DELAY): Shows(astray_m, 0.05, misplaced_m, 0.3),
    (Unit.GPS, Type.INTERMITTENT): Shows(astray_m, 0.02, unfixed, 0.2),
    (Unit.GYRO, Type.BIAS): Shows(turned_rad, 0.1, rate_radps, 0.15),
    (Unit.GYRO, Type.NOISE): Shows(turned_rad, 0.02, rate_radps, 0.5),
    (Unit.ACCEL, Type.BIAS): Shows(astray_m, None, force_mps2, 1.8),
    (Unit.ACCEL, Type.NOISE): Shows(astray_m, None, force_mps2, 3.0),
}


def ready() -> InWorld:
    world = InWorld(scenario("omni_plus"))
    for number in ASKED:
        world.tell(world.station.set_message_interval(1, number, 10.0))
    world.guided()
    world.run(1.0, {1: NORTH})
    return world


def driven(world: InWorld, *legs: tuple[float, Velocity]) -> Drive:
    world.clear()
    truth = []
    for seconds, velocity in legs:
        for _ in range(round(seconds * 10)):
            world.run(0.1, {1: velocity})
            place = world.truth()
            truth.append((place.north_m, place.east_m, place.yaw_rad))
    kinds = (LocalPosition, GpsRaw, RawImu, EscTelemetry, Attitude)
    return Drive(truth, *(world.sent(kind) for kind in kinds))  # type: ignore[arg-type]


def final_mps(drive: Drive) -> tuple[float, float]:
    """True speed north and east, mean of the last second."""
    (a, b, _), (c, d, _) = drive.truth[-11], drive.truth[-1]
    return c - a, d - b


def final_rpm(drive: Drive) -> float:
    """Mean of the last second and of both forward motors: what turns it cancels."""
    return statistics.mean(e.escs[i].rpm for e in drive.escs[-10:] for i in (0, 1))


BROKEN = ((3.0, NORTH), (3.0, SOUTH), (1.0, REST))
AFTER = ((7.0, (0.3, 0.4, 0.0)),)


def restored(world: InWorld) -> Drive:
    """Long after: at rest, in GUIDED again (whoever lost its GPS holds), and another drive."""
    world.run(15.0, {1: REST})
    world.guided()
    return driven(world, *AFTER)


@pytest.fixture(scope="module")
def sound() -> tuple[Drive, Drive]:
    """What a vehicle does that has no fault, both times."""
    world = ready()
    return driven(world, *BROKEN), restored(world)


def test_every_kind_is_here() -> None:
    assert SHOWS.keys() == KINDS.keys()


@pytest.mark.parametrize("fault", EXAMPLES.values(), ids=lambda f: f"{f.unit.name} {f.type}")
def test_a_fault_shows_in_truth_and_telemetry_and_clearing_restores_both(
    sound: tuple[Drive, Drive], fault: Fault
) -> None:
    shows, world, (beside, afterwards) = SHOWS[fault.unit, fault.type], ready(), sound
    world.inject(to_injection(fault))
    broken = driven(world, *BROKEN)
    if shows.true_least is None:
        assert broken.truth == beside.truth
    else:
        assert shows.true(beside, broken) >= shows.true_least
    assert shows.told(beside, broken) >= shows.told_least

    world.inject(to_clearing(fault.unit))
    after = restored(world)
    assert final_mps(after) == pytest.approx(final_mps(afterwards), abs=0.03)
    assert final_mps(after) == pytest.approx((0.3, 0.4), abs=0.06)
    assert abs(after.truth[-1][2]) < 0.06
    assert max(_gaps_m(after)) < 0.12
    assert {f.fix_type for f in after.fixes} == {FixType.RTK_FIXED}
    assert repeated(after, after) == 0.0
    assert abs(scatter_m(afterwards, after)) < 0.005
    assert rate_radps(afterwards, after) < 0.1
    assert force_mps2(afterwards, after) < 1.0
    assert final_rpm(after) == pytest.approx(final_rpm(afterwards), rel=0.1)
