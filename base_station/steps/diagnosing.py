"""[0b]-[2]: from an anomaly to a verdict, by experiment."""

from dataclasses import asdict, replace

import numpy as np

from base_station import doubt as doubts
from base_station import execution
from base_station.desk import Desk
from base_station.diagnosis import Verdict
from base_station.execution import Orders
from base_station.hypotheses import NONE, UNKNOWN
from base_station.phases import Concluding, Experimenting, PlanningAlpha, Settling
from base_station.planning.requests import OpenLoopPlan
from base_station.steps.travelling import request_beta
from base_station.telemetry import Frame
from base_station.watch import Watch

EXPERIMENT_MIN_S = 1.0
MOMENTS_PER_TICK = 15  # of the memory, each about 0.3 ms: a step must not take 10 ms
PLANNABLE_POSTERIOR = 0.005  # explanations less likely than this are not worth a contact


def settle(desk: Desk, phase: Settling, frame: Frame) -> Orders:
    """[0b] At rest: replay the memory under every hypothesis; decide, or ask for plan alpha."""
    caught_up = phase.hindsight.take(tuple(desk.watch.memory), MOMENTS_PER_TICK)
    if frame.time_s - phase.since_s < execution.REST_S or not caught_up:
        return desk.hold()
    opened = phase.hindsight.doubt()
    member = desk.view.fleet[opened.suspect]
    desk.doubt = doubts.anchor(opened, desk.mean_report_m())
    posterior = opened.verdict(desk.view.diagnosis.decide_at).posterior
    desk.say("hypotheses", f"{member.name}: {_shown(posterior)}", posterior=posterior)
    desk.tries = 0
    _conclude_or_plan(desk, conclusive=opened.verdict(desk.view.diagnosis.decide_at).decided)
    return desk.hold()


def _request_alpha(desk: Desk) -> None:
    doubt = desk.open_doubt
    p = doubt.posterior[: len(doubt.twins)]
    keep = [k for k in range(len(p)) if p[k] >= PLANNABLE_POSTERIOR]
    if len(keep) < 2:
        keep = sorted(np.argsort(p)[-2:].tolist())
    hypotheses, posterior, states = doubts.narrowed(doubt, keep)
    number = desk.ask("alpha", hypotheses, tuple(float(x) for x in posterior), states)
    desk.enter(PlanningAlpha(number))


def await_alpha(desk: Desk, number: int, frame: Frame) -> Orders:
    """[1] The fleet holds until the planner has answered."""
    answer = desk.answers.pop(number, None)
    if answer is None:
        return desk.hold()
    if answer.plan is None:
        desk.stop("cannot tell: no manoeuvre found that tells the hypotheses apart")
        return desk.hold()
    desk.doubt = doubts.anchor(doubts.awake(desk.open_doubt), desk.mean_report_m())
    desk.say("plan", announced(answer.plan), **_foretold(answer.plan))
    desk.enter(Experimenting(answer.plan, frame.time_s))
    return desk.hold()


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
        f"{touches or 'no contact'}"
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
    if frame.time_s - phase.since_s >= execution.REST_S:
        decided = desk.open_doubt.verdict(desk.view.diagnosis.decide_at).decided
        desk.tries += 1
        desk.doubt = doubts.anchor(desk.open_doubt, desk.mean_report_m())
        _conclude_or_plan(desk, conclusive=decided)
    return desk.hold()


def _conclude_or_plan(desk: Desk, conclusive: bool) -> None:
    verdict = desk.open_doubt.verdict(desk.view.diagnosis.decide_at)
    conclusive = conclusive and verdict.hypothesis != UNKNOWN
    if not conclusive and desk.tries < desk.view.diagnosis.tries:
        _request_alpha(desk)
        return
    desk.verdict = replace(verdict, decided=conclusive)
    name = desk.view.fleet[desk.open_doubt.suspect].name
    if not conclusive:
        desk.say(
            "verdict",
            f"{name}: cannot tell ({_shown(verdict.posterior)})",
            **_told(desk.verdict),
        )
        desk.stop("cannot tell")
        return
    desk.say(
        "verdict",
        f"{name}: {verdict.hypothesis} ({_shown(verdict.posterior)})",
        **_told(desk.verdict),
    )
    _believe(desk, verdict.hypothesis)
    request_beta(desk)


def _believe(desk: Desk, name: str) -> None:
    """From now on the fleet is watched under the verdict; the doubt is closed."""
    index = [h.name for h in desk.open_doubt.twins].index(name)
    baseline = desk.open_doubt.baseline
    if name != NONE:
        baseline = baseline.with_known(desk.open_doubt.twins[index])
    memory = desk.watch.memory
    desk.watch = Watch(desk.view, baseline, desk.open_doubt.states[index], desk.time_s)
    desk.watch.memory.extend(memory)
    desk.doubt = None
    desk.alarmed.clear()


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
