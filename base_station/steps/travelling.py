"""[3]-[4]: learn the mission under what is believed, drive it, and bring the helpers home."""

from dataclasses import replace

import numpy as np

from base_station import execution, mission, twin
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.phases import Finished, OnMission, PlanningBeta, Returning
from base_station.receiving.telemetry import Frame

MAX_MISSION_PLANS = 4
RETURN_TIMEOUT_S = 40.0
STALLED_M, STALLED_S = 0.05, 2.0  # who pushes gets further than this
SHAKE, SHAKE_S = 0.5, 2.0  # sigma of the action, and for how long
MAX_STALLS = 3


def request_beta(desk: Desk) -> None:
    """[3] Ask for a mission plan from where the believed twin stands."""
    number = desk.ask(
        "beta", mission.belief_of(desk.watch, desk.view), (1.0,), desk.watch.state[None]
    )
    desk.mission_plans += 1
    desk.enter(PlanningBeta(number))


def await_beta(desk: Desk, number: int, frame: Frame) -> Orders:
    """[3] The fleet holds until the planner has answered."""
    answer = desk.answers.pop(number, None)
    if answer is not None and answer.policy is None:
        desk.stop("no mission plan found")
    elif answer is not None and answer.policy is not None:
        desk.say("plan", "plan beta learnt")
        now_s, places_m = frame.time_s, mission.places_m(desk.watch)
        desk.enter(OnMission(answer.policy, now_s, now_s, desk.hold(), now_s, places_m, now_s))
    return desk.hold()


def drive(desk: Desk, phase: OnMission, frame: Frame) -> Orders:
    """[4] The policy decides once per control period, from the fleet as it is believed to be."""
    _deliver(desk, frame)
    if all(desk.goals.settled):
        desk.enter(Returning(frame.time_s))
        return desk.hold()
    if frame.time_s - phase.since_s > desk.view.planning.beta_horizon_s:
        _plan_mission_again(desk, "the plan ran out of time")
        return desk.hold()
    if frame.time_s < phase.next_control_s - 1e-6:
        return phase.orders
    phase = _unstuck(desk, phase, frame.time_s)
    if phase.stalls > MAX_STALLS:
        _plan_mission_again(desk, "nobody gets anywhere")
        return desk.hold()
    elapsed_s = frame.time_s - phase.clock_s
    shake = SHAKE if frame.time_s < phase.shaken_until_s else 0.0
    rng = np.random.default_rng((desk.view.station_seed, round(frame.time_s * 1000)))
    orders = mission.orders(phase.policy, desk.watch, desk.goals, elapsed_s, desk.view, shake, rng)
    next_s = phase.next_control_s + 1.0 / desk.view.clock.control_hz
    desk.phase = replace(phase, orders=orders, next_control_s=next_s)
    return orders


def _unstuck(desk: Desk, phase: OnMission, time_s: float) -> OnMission:
    """Nobody gets anywhere: begin anew, with the noise that the policy learnt with."""
    places_m = mission.places_m(desk.watch)
    if np.abs(places_m - phase.places_m).max() > STALLED_M:
        return replace(phase, places_m=places_m, moved_s=time_s)
    if time_s - phase.moved_s < STALLED_S:
        return phase
    return replace(
        phase,
        clock_s=time_s,
        moved_s=time_s,
        stalls=phase.stalls + 1,
        shaken_until_s=time_s + SHAKE_S,
    )


def _deliver(desk: Desk, frame: Frame) -> None:
    for v in desk.goals.newly_reached(desk.watch):
        member = desk.view.fleet[v]
        desk.goals = desk.goals.with_delivered(v, frame.time_s)
        desk.say("goal", f"{member.name} reached its goal", sysid=member.sysid)


def _plan_mission_again(desk: Desk, why: str) -> None:
    if desk.mission_plans >= MAX_MISSION_PLANS:
        desk.stop(f"mission given up: {why}")
        return
    desk.say("text", f"{why}: planning the mission again from here")
    plan_from_here(desk)


def plan_from_here(desk: Desk) -> None:
    """[3] Ask for a plan for what is still to be done."""
    desk.goals = desk.goals.only_still_there(desk.watch.state)
    request_beta(desk)


def go_home(desk: Desk, phase: Returning, frame: Frame) -> Orders:
    """Helpers drive back; when all are home and at rest, the mission is done or planned again."""
    drivers = mission.can_drive(desk.watch, desk.view)
    away = ~desk.goals.home(desk.watch.state, desk.orders.driven) & drivers
    away[list(desk.goals.left)] = False
    if away.any():
        if frame.time_s - phase.since_s > RETURN_TIMEOUT_S:
            _plan_mission_again(desk, "a rover found no way back")
            return desk.hold()
        desk.phase = replace(phase, still_since_s=None)
        position = desk.watch.state[:, twin.NORTH : twin.EAST + 1]
        return execution.return_orders(position, desk.goals.position_m, ~away, desk.view)
    still_since_s = phase.still_since_s
    if still_since_s is None or not frame.all_stand:
        still_since_s = frame.time_s
    desk.phase = replace(phase, still_since_s=still_since_s)
    if frame.time_s - still_since_s >= execution.REST_S:
        there = desk.goals.there(desk.watch.state)
        there[list(desk.goals.left)] = True
        if there.all():
            told = "all goals that can be" if desk.goals.left else "all goals"
            desk.say("end", f"{told} reached")
            desk.enter(Finished())
        else:
            _plan_mission_again(desk, "a vehicle was moved off its goal")
    return desk.hold()
