"""`hil check`: what a scenario holds, and whether its rescue can work at all (pure)."""

from pathlib import Path

from base_station.autopilots import adapter
from base_station.belief.hypotheses import candidates
from hil.airframe import push_margin
from hil.bench.firmware import can_break, is_foreign, start_of
from hil.bench.onsets import Onsets
from hil.bench.record import describe_fault
from hil.errors import InputError
from hil.faults import Type, Unit
from hil.link import MAVLINK_PORT_BASE
from hil.scenario import MIN_PUSH_MARGIN, FaultModel, Scenario, Vehicle, station_view

AXES = ("x", "y")


def describe(scenario: Scenario) -> str:
    """Fleet, faults and push margins, for people. Raises InputError for an unreadable onset."""
    Onsets(scenario)
    lines = [f"{scenario.name}: {len(scenario.fleet)} vehicles, yaw {scenario.yaw}, valid", ""]
    lines += [f"  {'vehicle':<12}{'sysid':>5}  {'start (N, E) m':<18}{'goal (N, E) m':<18}airframe"]
    lines += [_vehicle_line(v) for v in scenario.fleet]
    lines += ["", "  faults" if scenario.faults else "  no faults"]
    lines += [f"    {describe_fault(scenario, f)}, {_onset(f)}" for f in scenario.faults]
    lines += ["", f"  push margin of one rover and of all others; a rescue needs {MIN_PUSH_MARGIN}"]
    for v in scenario.fleet:
        margins = [
            f"body {a} {_one(scenario, v, a):.2f} / {margin(scenario, v, a):.2f}" for a in AXES
        ]
        lines.append(f"    pushing {v.name:<12}{'   '.join(margins)}")
    return "\n".join(lines)


def margin(scenario: Scenario, pushed: Vehicle, axis: str) -> float:
    """What all other vehicles give along an axis over what this one resists."""
    others = [v for v in scenario.fleet if v is not pushed]
    return sum(push_margin(v.frame, 1, pushed.frame, axis) for v in others)


def refuse_hopeless(path: Path, scenario: Scenario) -> None:
    """Raises InputError for an expectation that no run can meet."""
    _refuse_unknown_autopilot(path, scenario)
    _refuse_unbreakable(path, scenario)
    _refuse_unknown_hypothesis(path, scenario)
    _refuse_weak_rescue(path, scenario)


def _refuse_unknown_autopilot(path: Path, scenario: Scenario) -> None:
    for i, v in enumerate(scenario.fleet):
        try:
            adapter(v.autopilot, v.frame)
        except InputError as error:
            raise InputError(f"{path}: fleet.{i}.{error}") from None


def _refuse_unbreakable(path: Path, scenario: Scenario) -> None:
    """A foreign firmware knows nothing of our injector: what it has no parameter for, the world
    has to do."""
    for i, v in enumerate(scenario.fleet):
        if is_foreign(v) and start_of(v.autopilot) is None:
            raise InputError(
                f"{path}: fleet.{i}.autopilot = {v.autopilot!r} cannot be started here; "
                "use testbed, or start it by hand with `hil world`"
            )
    for i, fault in enumerate(scenario.faults):
        vehicle = scenario.vehicle(fault.vehicle)
        if not is_foreign(vehicle) or fault.by_world:
            continue
        if not can_break(scenario, fault):
            raise InputError(
                f"{path}: faults.{i}: {vehicle.name} is not ours to break from inside, and its "
                "firmware has no parameter for that; add applied_by: world"
            )
        if fault.onset.at_s == 0.0:
            raise InputError(
                f"{path}: faults.{i}.onset.at_s = 0: the firmware of {vehicle.name} takes a fault "
                "only while it runs; give a later time"
            )


def _refuse_unknown_hypothesis(path: Path, scenario: Scenario) -> None:
    expected = scenario.expect.hypothesis
    if expected is None:
        return
    known = {
        hypothesis.name
        for member in station_view(scenario, MAVLINK_PORT_BASE, 0).fleet
        for hypothesis in candidates(member, scenario.diagnosis.priors)
    }
    if expected not in known:
        raise InputError(
            f"{path}: expect.hypothesis = {expected!r}: no such hypothesis; "
            f"there are {', '.join(sorted(known))}"
        )


def _refuse_weak_rescue(path: Path, scenario: Scenario) -> None:
    """A rescue: yaw is locked, all motors of a body axis are off, yet that goal shall be reached.

    It needs others who are strong enough.
    """
    if scenario.yaw != "locked":
        return
    for i, fault in enumerate(scenario.faults):
        vehicle = scenario.vehicle(fault.vehicle)
        if "reached" not in scenario.expect.goals.get(vehicle.sysid, ()):
            continue
        for axis in _dead_axes(fault, vehicle):
            have = margin(scenario, vehicle, axis)
            if have < MIN_PUSH_MARGIN:
                raise InputError(
                    f"{path}: faults.{i}: {vehicle.name} cannot be rescued: the push margin along "
                    f"body {axis} is {have:.2f}; at least {MIN_PUSH_MARGIN} is needed; "
                    "add vehicles, or do not expect its goal to be reached"
                )


def _dead_axes(fault: FaultModel, vehicle: Vehicle) -> list[str]:
    what = fault.fault()
    if (what.unit, what.type) != (Unit.MOTOR, Type.OFF):
        return []
    off = what.instances or range(1, len(vehicle.frame.motors) + 1)
    return [a for a in AXES if set(vehicle.frame.axis_motors(a)) <= set(off)]


def _one(scenario: Scenario, pushed: Vehicle, axis: str) -> float:
    others = [v for v in scenario.fleet if v is not pushed]
    return max((push_margin(v.frame, 1, pushed.frame, axis) for v in others), default=0.0)


def _vehicle_line(v: Vehicle) -> str:
    start = f"{v.start.north_m:6.2f} {v.start.east_m:6.2f}"
    goal = f"{v.goal.north_m:6.2f} {v.goal.east_m:6.2f}"
    return f"  {v.name:<12}{v.sysid:>5}  {start:<18}{goal:<18}{v.airframe}"


def _onset(fault: FaultModel) -> str:
    return f"when {fault.onset.when}" if fault.onset.when else f"at {fault.onset.at_s:g} s"
