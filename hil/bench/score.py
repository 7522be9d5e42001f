"""The score: what the station concluded, against the truth and the expectation (pure)."""

import math
from dataclasses import dataclass

from base_station.belief.hypotheses import NONE, UNKNOWN, candidates
from hil.bench.labels import expected_hypothesis
from hil.bench.lines import Outcome, Verdict
from hil.bench.record import RunRecord, Struck
from hil.scenario import GoalOutcome, Scenario, station_view
from hil.world.truth import TruthRecord

ARRIVED_M = 0.3  # a goal that is declared reached must truly be this near


@dataclass(frozen=True)
class GoalScore:
    """`declared` and `time_s` are the station's belief, `distance_m` is the truth at the end."""

    declared: GoalOutcome
    time_s: float | None
    distance_m: float

    @property
    def reached(self) -> bool:
        return self.distance_m <= ARRIVED_M


@dataclass(frozen=True)
class Score:
    """`unmet` says in words what was not as expected; empty means all was."""

    correct: bool
    true_hypotheses: dict[int, str]
    goals: dict[int, GoalScore]
    unmet: tuple[str, ...]

    @property
    def expected_met(self) -> bool:
        return not self.unmet


def score(scenario: Scenario, run: RunRecord) -> Score:
    """Judge a run that came to an outcome. Raises ValueError when it did not."""
    if run.outcome is None or run.truth is None:
        raise ValueError("a run without outcome and truth cannot be scored")
    truth = true_hypotheses(scenario, run.struck)
    goals = _goals(scenario, run.outcome, run.truth)
    correct = is_correct(run.outcome.verdict, truth)
    unmet = (
        *_unmet_verdict(scenario, run.outcome),
        *_unmet_goals(scenario, goals),
        *(() if correct else (f"the verdict does not fit the truth ({_named(truth)})",)),
    )
    return Score(correct, truth, goals, unmet)


def true_hypotheses(scenario: Scenario, struck: tuple[Struck, ...]) -> dict[int, str]:
    """By system id, the name the station has for what was really broken; 'unknown' if none."""
    members = {m.sysid: m for m in station_view(scenario, 1024, 0).fleet}
    names = {}
    for sysid in {s.fault.vehicle for s in struck}:
        faults = [s.fault.fault() for s in struck if s.fault.vehicle == sysid]
        name = expected_hypothesis(faults, members[sysid].frame)
        known = candidates(members[sysid], scenario.diagnosis.priors)
        names[sysid] = name if name in {h.name for h in known} else UNKNOWN
    return names


def is_correct(verdict: Verdict | None, truth: dict[int, str]) -> bool:
    """A healthy fleet is rightly left alone, or cleared; a broken one needs the right name."""
    if verdict is None:
        return not truth
    if not verdict.decided:
        return False
    return truth.get(verdict.sysid, NONE) == verdict.hypothesis


def _goals(scenario: Scenario, outcome: Outcome, truth: TruthRecord) -> dict[int, GoalScore]:
    goals = {}
    for v in scenario.fleet:
        body, told = truth.vehicles[v.sysid], outcome.goals.get(v.sysid)
        distance_m = math.dist((body.north_m, body.east_m), (v.goal.north_m, v.goal.east_m))
        goals[v.sysid] = GoalScore(
            told.declared if told else "unreached", told.time_s if told else None, distance_m
        )
    return goals


def _unmet_verdict(scenario: Scenario, outcome: Outcome) -> list[str]:
    expect, verdict = scenario.expect, outcome.verdict
    unmet = []
    if outcome.alarm != expect.alarm:
        unmet.append("no alarm was raised" if expect.alarm else "an alarm was raised")
    if expect.sysid is not None and (verdict is None or verdict.sysid != expect.sysid):
        whom = f"vehicle {verdict.sysid}" if verdict else "nobody"
        unmet.append(f"suspected {whom} instead of vehicle {expect.sysid}")
    if expect.hypothesis is not None:
        decided = verdict.hypothesis if verdict and verdict.decided else "nothing"
        if decided != expect.hypothesis:
            unmet.append(f"decided for {decided} instead of {expect.hypothesis}")
    return unmet


def _unmet_goals(scenario: Scenario, goals: dict[int, GoalScore]) -> list[str]:
    unmet = []
    for sysid, allowed in scenario.expect.goals.items():
        goal, name = goals[sysid], scenario.vehicle(sysid).name
        if goal.declared not in allowed:
            unmet.append(f"goal of {name} is {goal.declared} instead of {' or '.join(allowed)}")
    for sysid, goal in goals.items():
        if goal.declared == "reached" and not goal.reached:
            name = scenario.vehicle(sysid).name
            unmet.append(
                f"goal of {name} is declared reached from {goal.distance_m:.2f} m away; "
                f"at most {ARRIVED_M} m is right"
            )
    return unmet


def _named(truth: dict[int, str]) -> str:
    return ", ".join(f"vehicle {s}: {name}" for s, name in truth.items()) or "nothing broken"
