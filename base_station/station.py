"""The whole mission as a state machine: messages and time in, commands and requests out. No I/O.

One tick: frame of the fleet -> believed twin and detector (`watch`), twins in doubt (`doubt`) ->
the phase decides orders and the next phase -> `commander` turns orders into commands.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from base_station import doubt as doubts
from base_station import execution, mission, twin
from base_station.commander import Commander
from base_station.commands import AskTime, Command, Heartbeat
from base_station.diagnosis import Verdict
from base_station.doubt import Doubt
from base_station.execution import Orders
from base_station.fleet import Fleet
from base_station.hypotheses import NONE, UNKNOWN, candidates
from base_station.phases import (
    AnyPhase,
    Arming,
    Concluding,
    Connecting,
    Experimenting,
    Finished,
    Holding,
    OnMission,
    PlanningAlpha,
    PlanningBeta,
    Probing,
    Returning,
    Settling,
)
from base_station.planning.requests import PlanReady, PlanRequest
from base_station.records import Event, EventKind, Snapshot
from base_station.snapshots import snapshot
from base_station.telemetry import Frame
from base_station.watch import Baseline, Watch
from hil import mavlink
from hil.mavlink import RoverMode
from hil.scenario import StationView

Array = NDArray[np.float64]

HEARTBEAT_S = 1.0
TIMESYNC_S = 1.0
REST_S = 1.5  # a rover at the speed limit coasts to rest in 1 s
EXPERIMENT_MIN_S = 1.0
CONTACT_GAP_S = 1.0  # two touches of a pair closer in time than this are one
PLANNABLE_POSTERIOR = 0.005  # explanations less likely than this are not worth a contact
MAX_MISSION_PLANS = 4
STALLED_M, STALLED_S = 0.05, 2.0  # who pushes gets further than this
SHAKE, SHAKE_S = 0.5, 2.0  # sigma of the action, and for how long
MAX_STALLS = 3
RETURN_TIMEOUT_S = 40.0


@dataclass(frozen=True)
class Outputs:
    """What one step wants done and said."""

    commands: tuple[Command, ...] = ()
    request: PlanRequest | None = None
    events: tuple[Event, ...] = ()
    snapshots: tuple[Snapshot, ...] = ()


class Station:
    """Drives one fleet through the paper's steps [0a]-[4]. `step` never blocks."""

    def __init__(self, view: StationView) -> None:
        self.view = view
        self.fleet = Fleet(view)
        self.commander = Commander(view)
        self.phase: AnyPhase = Connecting()
        self.watch: Watch | None = None
        self.doubt: Doubt | None = None
        self.verdict: Verdict | None = None
        self.alarm = False
        self.goals = mission.Goals.of(view)
        self.time_s = 0.0
        self.orders: Orders = execution.hold(len(view.fleet))
        self._answers: dict[int, PlanReady] = {}
        self._requests = 0
        self._tries = 0
        self._mission_plans = 0
        self._mission_s = 0.0  # on the way, planning not counted
        self._alarmed: dict[int, tuple[float, float]] = {}  # vehicle: last quiet, alarm (s)
        self._touched_s: dict[tuple[int, int], float] = {}
        self._beats_s = (float("-inf"), float("-inf"))  # last heartbeat: wall, fleet
        self._asked_time_s = float("-inf")
        self._events: list[Event] = []
        self._request: PlanRequest | None = None

    @property
    def ended(self) -> bool:
        return isinstance(self.phase, Holding | Finished)

    # ------------------------------------------------------------------ one step

    def step(
        self,
        wall_s: float,
        received: Sequence[tuple[int, mavlink.Received]],
        answers: Sequence[PlanReady] = (),
    ) -> Outputs:
        """Take in what has arrived (fleet index, message), and do what is due.

        `wall_s` is any monotonic clock; it serves pacing and link loss only.
        """
        commands: list[Command] = []
        snapshots: list[Snapshot] = []
        self._answers.update({a.number: a for a in answers})
        for index, message in received:
            self.fleet.receive(index, message, wall_s)
            self._note(index, message)
        self.time_s = max(self.time_s, self.fleet.newest_s)
        commands += self._keep_alive(wall_s)
        if isinstance(self.phase, Connecting | Arming):
            commands += self._get_ready()
        for frame in self.fleet.due() if self.watch else ():
            commands += self._tick(frame)
            snapshots.append(snapshot(self, frame))
        events, self._events = tuple(self._events), []
        request, self._request = self._request, None
        return Outputs(tuple(commands), request, events, tuple(snapshots))

    def _note(self, index: int, message: mavlink.Received) -> None:
        name = self.view.fleet[index].name
        match message.value:
            case mavlink.CommandAck(command=mavlink.Command.DO_SET_MODE, result=0):
                asked = self.commander.mode_asked(index)
                if asked is not None:
                    self.fleet.mode_acknowledged(index, asked)
            case mavlink.CommandAck(command=command, result=result) if result:
                self._say("command", f"{name} refused command {command} (result {result})")
            case mavlink.StatusText(text=text):
                self._say("text", f"{name}: {text}", sysid=self.view.fleet[index].sysid)
            case _:
                pass

    def _keep_alive(self, wall_s: float) -> list[Command]:
        commands: list[Command] = []
        if (
            wall_s - self._beats_s[0] >= HEARTBEAT_S
            or self.time_s - self._beats_s[1] >= HEARTBEAT_S
        ):
            self._beats_s = (wall_s, self.time_s)
            commands += [Heartbeat(m.sysid) for m in self.view.fleet]
        if wall_s - self._asked_time_s >= TIMESYNC_S:
            self._asked_time_s = wall_s
            commands += [AskTime(m.sysid, int(wall_s * 1e9)) for m in self.view.fleet]
        return commands

    def _get_ready(self) -> list[Command]:
        tracks = self.fleet.tracks
        if isinstance(self.phase, Connecting):
            if not self.fleet.complete:
                return []
            self._say("link", f"{len(tracks)} vehicles heard, located and ready")
            self._enter(Arming())
        commands = self.commander.carry_out(self.orders, tracks, self.time_s)
        commands += self.commander.arm(tracks, self.time_s)
        if all(t.status.armed and t.status.mode == RoverMode.HOLD for t in tracks):
            self.fleet.start_ticks()
            self.watch = self._fresh_watch()
            self._enter(Probing(self.time_s))
        return commands

    def _fresh_watch(self) -> Watch:
        newest = [t.samples[-1] for t in self.fleet.tracks]
        state = twin.initial_state(
            [s.position_m for s in newest], [t.status.yaw_rad for t in self.fleet.tracks]
        )
        return Watch(self.view, Baseline(twin.FleetModel.from_view(self.view)), state, self.time_s)

    def _tick(self, frame: Frame) -> list[Command]:
        assert self.watch is not None
        alarms = self.watch.tick(frame, self.orders)
        if self.doubt is not None:
            self.doubt = doubts.tick(self.doubt, frame, self.orders, self.fleet.period_s)
        else:
            self._take_alarms(alarms)
        self._note_contacts(frame)
        for i in self.commander.takeovers(frame.time_s):
            self.commander.released.add(i)
            self._say(
                "takeover", f"{self.view.fleet[i].name} was taken over: not commanded any more"
            )
            self._stop("takeover")
        if isinstance(self.phase, OnMission | Returning):
            self._mission_s += self.fleet.period_s
            if self._mission_s > self.view.limits.mission_timeout_s:
                self._stop(f"mission not done after {self._mission_s:.0f} s")
        self.orders = self._decide(frame)
        return self.commander.carry_out(self.orders, self.fleet.tracks, frame.time_s)

    def _note_contacts(self, frame: Frame) -> None:
        """A contact is what the believed twin makes of it: no rover here can feel one."""
        assert self.watch is not None
        for pair in self.watch.contacts:
            if frame.time_s - self._touched_s.get(pair, float("-inf")) > CONTACT_GAP_S:
                a, b = (self.view.fleet[i] for i in pair)
                self._say("contact", f"{a.name} touches {b.name}", sysids=[a.sysid, b.sysid])
            self._touched_s[pair] = frame.time_s

    def _take_alarms(self, alarms: Sequence[int]) -> None:
        assert self.watch is not None
        for i in alarms:
            if i in self._alarmed or self.ended:
                continue
            self.alarm = True
            self._alarmed[i] = (float(self.watch.cusum.quiet_since_s[i]), self.time_s)
            axis = int(self.watch.cusum.level[i].argmax())
            north_east = ("north", "east")[axis]
            member = self.view.fleet[i]
            self._say(
                "anomaly",
                f"{member.name} does not answer as its twin does ({north_east})",
                sysid=member.sysid,
                axis=north_east,
                statistic=round(float(self.watch.cusum.level[i, axis]), 2),
                threshold=round(self.watch.threshold, 2),
            )

    # ------------------------------------------------------------------ the phases

    def _decide(self, frame: Frame) -> Orders:
        match self.phase:
            case Probing():
                return self._probe(self.phase, frame)
            case Settling():
                return self._settle(self.phase, frame)
            case PlanningAlpha(number=number):
                return self._await_alpha(number, frame)
            case Experimenting():
                return self._experiment(self.phase, frame)
            case Concluding(since_s=since_s):
                if frame.time_s - since_s >= REST_S:
                    self._conclude()
                return self._hold()
            case PlanningBeta(number=number):
                return self._await_beta(number, frame)
            case OnMission():
                return self._drive(self.phase, frame)
            case Returning():
                return self._return(self.phase, frame)
            case _:
                return self._hold()

    def _hold(self) -> Orders:
        return execution.hold(len(self.view.fleet))

    def _probe(self, phase: Probing, frame: Frame) -> Orders:
        pulses = execution.probe_pulses(len(self.view.fleet))
        pulse, driven = execution.pulse_at(pulses, frame.time_s - phase.since_s, self.view)
        if pulse is None:
            if self._alarmed:
                self._suspect_the_worst(frame)
            else:
                self._say("text", "all vehicles answer as their twins do")
                self._request_beta()
            return self._hold()
        if not driven:
            return self._hold()
        return execution.pulse_orders(pulse, float(frame.yaw_rad[pulse.vehicle]), self.view)

    def _suspect_the_worst(self, frame: Frame) -> None:
        assert self.watch is not None
        suspect = max(self._alarmed, key=lambda i: float(self.watch.cusum.level[i].max()))  # type: ignore[union-attr]
        self._enter(Settling(frame.time_s, suspect, self._alarmed[suspect]))

    def _settle(self, phase: Settling, frame: Frame) -> Orders:
        assert self.watch is not None
        if frame.time_s - phase.since_s < REST_S:
            return self._hold()
        member = self.view.fleet[phase.suspect]
        opened = doubts.open_doubt(
            self.watch.baseline,
            tuple(self.watch.memory),
            phase.suspect,
            candidates(member, self.view.diagnosis.priors),
            phase.struck_between_s,
            self.fleet.period_s,
        )
        self.doubt = doubts.anchor(opened, self._mean_report())
        posterior = opened.verdict(self.view.diagnosis.decide_at).posterior
        self._say("hypotheses", f"{member.name}: {_shown(posterior)}", posterior=posterior)
        self._tries = 0
        self._conclude_or_plan(conclusive=opened.verdict(self.view.diagnosis.decide_at).decided)
        return self._hold()

    def _mean_report(self) -> Array:
        """[V, 2] mean of the last second of reports of the fleet at rest."""
        assert self.watch is not None
        recent = [
            m.frame.position_m for m in list(self.watch.memory)[-round(1.0 / self.fleet.period_s) :]
        ]
        return np.asarray(np.nanmean(recent, axis=0))

    def _request_alpha(self) -> None:
        assert self.doubt is not None
        p = self.doubt.posterior[: len(self.doubt.twins)]
        keep = [k for k in range(len(p)) if p[k] >= PLANNABLE_POSTERIOR]
        if len(keep) < 2:
            keep = sorted(np.argsort(p)[-2:].tolist())
        hypotheses, posterior, states = doubts.narrowed(self.doubt, keep)
        self._requests += 1
        self._request = PlanRequest(
            number=self._requests,
            kind="alpha",
            seed=self.view.station_seed + self._requests,
            preset=self.view.planning.preset,
            hypotheses=hypotheses,
            posterior=tuple(float(x) for x in posterior),
            states=states,
            delivered=self.goals.delivered,
        )
        self._enter(PlanningAlpha(self._requests))

    def _await_alpha(self, number: int, frame: Frame) -> Orders:
        answer = self._answers.pop(number, None)
        if answer is not None and answer.plan is None:
            self._stop("cannot tell: no manoeuvre found that tells the hypotheses apart")
        elif answer is not None and answer.plan is not None:
            assert self.doubt is not None
            self.doubt = doubts.anchor(doubts.awake(self.doubt), self._mean_report())
            error = answer.plan.predicted_error
            self._say(
                "plan",
                f"plan alpha: predicted error {error:.2g} over {_duration_s(answer):.1f} s",
                predicted_error=error,
            )
            self._enter(Experimenting(answer.plan, frame.time_s))
        return self._hold()

    def _experiment(self, phase: Experimenting, frame: Frame) -> Orders:
        assert self.doubt is not None
        elapsed_s = frame.time_s - phase.since_s
        orders = execution.plan_orders(phase.plan, elapsed_s)
        decided = self.doubt.verdict(self.view.diagnosis.decide_at).decided
        if orders is None or (decided and elapsed_s >= EXPERIMENT_MIN_S):
            self._enter(Concluding(frame.time_s))
            return self._hold()
        return orders

    def _conclude(self) -> None:
        assert self.doubt is not None
        decided = self.doubt.verdict(self.view.diagnosis.decide_at).decided
        self._tries += 1
        self.doubt = doubts.anchor(self.doubt, self._mean_report())
        self._conclude_or_plan(conclusive=decided)

    def _conclude_or_plan(self, conclusive: bool) -> None:
        assert self.doubt is not None
        verdict = self.doubt.verdict(self.view.diagnosis.decide_at)
        conclusive = conclusive and verdict.hypothesis != UNKNOWN
        if not conclusive and self._tries < self.view.diagnosis.tries:
            self._request_alpha()
            return
        self.verdict = replace(verdict, decided=conclusive)
        name = self.view.fleet[self.doubt.suspect].name
        if not conclusive:
            self._say(
                "verdict",
                f"{name}: cannot tell ({_shown(verdict.posterior)})",
                **_told(self.verdict),
            )
            self._stop("cannot tell")
            return
        self._say(
            "verdict",
            f"{name}: {verdict.hypothesis} ({_shown(verdict.posterior)})",
            **_told(self.verdict),
        )
        self._believe(verdict.hypothesis)
        self._request_beta()

    def _believe(self, name: str) -> None:
        """From now on the fleet is watched under the verdict; the doubt is closed."""
        assert self.doubt is not None
        assert self.watch is not None
        index = [h.name for h in self.doubt.twins].index(name)
        baseline = self.doubt.baseline
        if name != NONE:
            baseline = baseline.with_known(self.doubt.twins[index])
        memory = self.watch.memory
        self.watch = Watch(self.view, baseline, self.doubt.states[index], self.time_s)
        self.watch.memory.extend(memory)
        self.doubt = None
        self._alarmed.clear()

    def _request_beta(self) -> None:
        assert self.watch is not None
        self._requests += 1
        self._request = PlanRequest(
            number=self._requests,
            kind="beta",
            seed=self.view.station_seed + self._requests,
            preset=self.view.planning.preset,
            hypotheses=mission.belief_of(self.watch, self.view),
            posterior=(1.0,),
            states=self.watch.state[None],
            delivered=self.goals.delivered,
        )
        self._mission_plans += 1
        self._enter(PlanningBeta(self._requests))

    def _await_beta(self, number: int, frame: Frame) -> Orders:
        if self._alarmed:
            self._suspect_the_worst(frame)
            return self._hold()
        answer = self._answers.pop(number, None)
        assert self.watch is not None
        if answer is not None and answer.policy is None:
            self._stop("no mission plan found")
        elif answer is not None and answer.policy is not None:
            self._say("plan", "plan beta learnt")
            now_s, places_m = frame.time_s, mission.places_m(self.watch)
            self._enter(
                OnMission(answer.policy, now_s, now_s, self._hold(), now_s, places_m, now_s)
            )
        return self._hold()

    def _drive(self, phase: OnMission, frame: Frame) -> Orders:
        assert self.watch is not None
        if self._alarmed:
            self._suspect_the_worst(frame)
            return self._hold()
        self._deliver(frame)
        if all(self.goals.delivered):
            self._enter(Returning(frame.time_s))
            return self._hold()
        if frame.time_s - phase.since_s > self.view.planning.beta_horizon_s:
            self._plan_mission_again("the plan ran out of time")
            return self._hold()
        if frame.time_s < phase.next_control_s - 1e-6:
            return phase.orders
        phase = self._unstuck(phase, frame.time_s)
        if phase.stalls > MAX_STALLS:
            self._plan_mission_again("nobody gets anywhere")
            return self._hold()
        elapsed_s = frame.time_s - phase.clock_s
        shake = SHAKE if frame.time_s < phase.shaken_until_s else 0.0
        rng = np.random.default_rng((self.view.station_seed, round(frame.time_s * 1000)))
        orders = mission.orders(
            phase.policy, self.watch, self.goals, elapsed_s, self.view, shake, rng
        )
        next_s = phase.next_control_s + 1.0 / self.view.clock.control_hz
        self.phase = replace(phase, orders=orders, next_control_s=next_s)
        return orders

    def _unstuck(self, phase: OnMission, time_s: float) -> OnMission:
        """Nobody gets anywhere: begin anew, with the noise that the policy learnt with."""
        assert self.watch is not None
        places_m = mission.places_m(self.watch)
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

    def _deliver(self, frame: Frame) -> None:
        assert self.watch is not None
        for v in self.goals.newly_reached(self.watch):
            member = self.view.fleet[v]
            self.goals = self.goals.with_delivered(v, frame.time_s)
            self._say("goal", f"{member.name} reached its goal", sysid=member.sysid)

    def _plan_mission_again(self, why: str) -> None:
        if self._mission_plans >= MAX_MISSION_PLANS:
            self._stop(f"mission given up: {why}")
            return
        assert self.watch is not None
        self._say("text", f"{why}: planning the mission again from here")
        self.goals = self.goals.only_still_there(self.watch.state)
        self._request_beta()

    def _return(self, phase: Returning, frame: Frame) -> Orders:
        assert self.watch is not None
        if self._alarmed:
            self._suspect_the_worst(frame)
            return self._hold()
        drivers = mission.can_drive(self.watch, self.view)
        away = ~self.goals.home(self.watch.state, self.orders.driven) & drivers
        if away.any():
            if frame.time_s - phase.since_s > RETURN_TIMEOUT_S:
                self._plan_mission_again("a rover found no way back")
                return self._hold()
            self.phase = replace(phase, still_since_s=None)
            position = self.watch.state[:, twin.NORTH : twin.EAST + 1]
            return execution.return_orders(position, self.goals.position_m, ~away, self.view)
        still_since_s = frame.time_s if phase.still_since_s is None else phase.still_since_s
        self.phase = replace(phase, still_since_s=still_since_s)
        if frame.time_s - still_since_s >= REST_S:
            if self.goals.there(self.watch.state).all():
                self._say("end", "all goals reached")
                self._enter(Finished())
            else:
                self._plan_mission_again("a vehicle was moved off its goal")
        return self._hold()

    # ------------------------------------------------------------------ words

    def _stop(self, reason: str) -> None:
        self._say("end", f"holding: {reason}")
        self._enter(Holding(reason))

    def _enter(self, phase: AnyPhase) -> None:
        if phase.name != self.phase.name:
            self._say("phase", phase.name)
        self.phase = phase

    def _say(self, kind: EventKind, text: str, **data: object) -> None:
        self._events.append(Event(round(self.time_s, 3), kind, text, data))


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


def _duration_s(answer: PlanReady) -> float:
    return len(answer.plan.setpoints) * answer.plan.period_s if answer.plan else 0.0
