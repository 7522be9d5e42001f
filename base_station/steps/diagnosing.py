"""[0b]-[2]: from an anomaly to a verdict, by experiment."""

from dataclasses import asdict, replace

from base_station import execution, mission
from base_station.belief import doubt as doubts
from base_station.belief import escalation, hearing
from base_station.belief.diagnosis import Verdict
from base_station.belief.fixes import has_fix
from base_station.belief.hypotheses import NONE, UNKNOWN
from base_station.belief.watch import Watch
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.phases import Concluding, Experimenting, PlanningAlpha, Settling
from base_station.planning.requests import OpenLoopPlan
from base_station.planning.tasks.objectives import GAIN
from base_station.receiving.telemetry import Frame
from base_station.steps.travelling import request_beta

EXPERIMENT_MIN_S = 1.0
MOMENTS_PER_TICK = 4  # of the memory, each about 2 ms: a step must not take 10 ms


def settle(desk: Desk, phase: Settling, frame: Frame) -> Orders:
    """[0b] At rest: replay the memory under every hypothesis; decide, or ask for plan alpha."""
    caught_up = phase.hindsight.take(tuple(desk.watch.memory), MOMENTS_PER_TICK)
    if not frame.all_stand:
        desk.phase = replace(phase, since_s=frame.time_s)
        return desk.hold()
    if not (caught_up and desk.at_rest(phase.since_s)):
        return desk.hold()
    opened = phase.hindsight.doubt()
    if hearing.trouble(frame, desk.fleet.period_s).any():
        opened = doubts.questioned(opened)
    member = desk.view.fleet[opened.suspect]
    desk.doubt = doubts.anchor(opened, desk.mean_report_m(opened.suspect))
    posterior = opened.verdict(desk.view.diagnosis.decide_at).posterior
    desk.say("hypotheses", f"{member.name}: {_shown(posterior)}", posterior=posterior)
    desk.tries, desk.soloed = 0, False
    _escalate(desk, named=opened.verdict(desk.view.diagnosis.decide_at).decided)
    return desk.hold()


def _escalate(desk: Desk, named: bool) -> None:
    """Conclude when that is due; else the suspect alone, then contact, then give up.

    `named`: the evidence of the last experiment named one explanation.
    """
    doubt, diagnosis = desk.open_doubt, desk.view.diagnosis
    best = doubt.verdict(diagnosis.decide_at)
    if best.hypothesis == UNKNOWN and best.decided and (desk.soloed or desk.tries):
        _give_up(desk, "no explanation that is known fits")
    elif named and best.hypothesis != UNKNOWN:
        _believe(desk, best)
    elif not desk.soloed and (plan := escalation.solo(doubt, desk.view)) is not None:
        desk.soloed = True
        twins = tuple(doubt.twins[t].name for t in escalation.plausible(doubt))
        _begin(desk, plan, twins, "plan alpha: the suspect alone, there and back on each axis")
    elif best.hypothesis != UNKNOWN and escalation.remedy_posterior(doubt) >= diagnosis.decide_at:
        _believe(desk, best)
    elif desk.tries < diagnosis.tries:
        _request_alpha(desk)
    else:
        _give_up(desk, f"not after {desk.tries} experiments")


def _request_alpha(desk: Desk) -> None:
    hypotheses, posterior, states = doubts.narrowed(
        desk.open_doubt, escalation.for_contact(desk.open_doubt)
    )
    number = desk.ask("alpha", hypotheses, tuple(float(x) for x in posterior), states)
    desk.enter(PlanningAlpha(number, tuple(h.name for h in hypotheses)))


def await_alpha(desk: Desk, phase: PlanningAlpha) -> Orders:
    """[1] The fleet holds until the planner has answered."""
    answer = desk.answers.pop(phase.number, None)
    if answer is None:
        return desk.hold()
    if answer.plan is None:
        desk.stop("cannot tell: no manoeuvre found that tells the hypotheses apart")
        return desk.hold()
    desk.tries += 1
    _begin(desk, answer.plan, phase.twins, announced(answer.plan), **_foretold(answer.plan))
    return desk.hold()


def _begin(
    desk: Desk, plan: OpenLoopPlan, twins: tuple[str, ...], text: str, **data: object
) -> None:
    desk.doubt = doubts.anchor(
        doubts.awake(desk.open_doubt), desk.mean_report_m(desk.open_doubt.suspect)
    )
    desk.say("plan", text, **data)
    desk.enter(Experimenting(plan, desk.time_s, twins))


def announced(plan: OpenLoopPlan) -> str:
    """A plan in a line, before it is driven."""
    duration_s = len(plan.setpoints) * plan.period_s
    text = f"plan alpha: predicted error {plan.predicted_error:.2g} over {duration_s:.1f} s"
    if (told := plan.prediction) is None:
        return text
    touches = "; ".join(
        f"{a} and {b} touch, up to {c.speed_mps:.2f} m/s, {c.impulse_ns:.1f} N s"
        for c in told.contacts
        for a, b in [c.between]
    )
    return (
        f"{text}; {told.information_bits:.2f} of {told.open_bits:.2f} bit, "
        f"{told.information_low_bits:.2f} in the worst tenth; {told.energy_j:.0f} J; "
        f"cost {told.cost:.2f} of {GAIN:.0f}; {touches or 'no contact'}"
    )


def _foretold(plan: OpenLoopPlan) -> dict[str, object]:
    told = {} if plan.prediction is None else asdict(plan.prediction)
    return {"predicted_error": plan.predicted_error, **told}


def experiment(desk: Desk, phase: Experimenting, frame: Frame) -> Orders:
    """[2] Drive plan alpha to its end, or until it has decided."""
    elapsed_s = frame.time_s - phase.since_s
    orders = execution.plan_orders(phase.plan, elapsed_s)
    decided = desk.open_doubt.verdict(desk.view.diagnosis.decide_at).decided
    if orders is None or (decided and elapsed_s >= EXPERIMENT_MIN_S):
        desk.enter(Concluding(frame.time_s))
        return desk.hold()
    return orders


def conclude(desk: Desk, phase: Concluding, frame: Frame) -> Orders:
    """[2] At rest: the verdict, or another plan from where each twin stands now."""
    if not frame.all_stand:
        desk.phase = replace(phase, since_s=frame.time_s)
    elif desk.at_rest(phase.since_s):
        named = desk.open_doubt.verdict(desk.view.diagnosis.decide_at).decided
        desk.doubt = doubts.anchor(desk.open_doubt, desk.mean_report_m(desk.open_doubt.suspect))
        _escalate(desk, named)
    return desk.hold()


def _give_up(desk: Desk, why: str) -> None:
    best = desk.open_doubt.verdict(desk.view.diagnosis.decide_at)
    desk.verdict = replace(best, decided=False)
    name = desk.view.fleet[desk.open_doubt.suspect].name
    text = f"{name}: cannot tell: {why} ({_shown(best.posterior)})"
    desk.say("verdict", text, **_told(desk.verdict))
    desk.stop("cannot tell")


def _believe(desk: Desk, verdict: Verdict) -> None:
    """From now on the fleet is watched under the verdict; the doubt is closed."""
    doubt = desk.open_doubt
    desk.verdict = replace(verdict, decided=True)
    name = desk.view.fleet[doubt.suspect].name
    text = f"{name}: {verdict.hypothesis} ({_shown(verdict.posterior)})"
    desk.say("verdict", text, **_told(desk.verdict))
    index = [h.name for h in doubt.twins].index(verdict.hypothesis)
    baseline = doubt.baseline
    if verdict.hypothesis != NONE:
        baseline = baseline.with_known(doubt.estimated(index))
    memory, states = desk.watch.memory, doubt.of_twins()[0]
    desk.watch = Watch(desk.view, baseline, states[index], desk.time_s)
    desk.watch.memory.extend(memory)
    newest = memory[-1].frame
    if has_fix(newest, doubt.suspect):  # judged by its fixes, watched by its estimate again
        told = replace(newest, position_m=desk.mean_report_m())
        desk.watch.restart(baseline.corrected(told))
    desk.doubt = None
    desk.alarmed.clear()
    if mission.must_be_left(doubt.estimated(index), desk.view):
        desk.goals = desk.goals.leaving(doubt.suspect)
        desk.say("text", f"{name} is left where it is: its autopilot needs its GPS to drive")
    request_beta(desk)


def _shown(posterior: dict[str, float]) -> str:
    ranked = sorted(posterior.items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {p:.3f}" for name, p in ranked if p >= 0.0005)


def _told(verdict: Verdict) -> dict[str, object]:
    return {
        "sysid": verdict.sysid,
        "hypothesis": verdict.hypothesis,
        "posterior": verdict.posterior,
        "decided": verdict.decided,
    }
