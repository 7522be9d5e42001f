"""The whole mission as a state machine: messages and time in, commands and requests out. No I/O.

One tick: frame of the fleet -> believed twin and detector (`watch`), twins in doubt (`doubt`) ->
the step that the phase belongs to decides orders and the next phase (`steps/`) -> `commander` turns
orders into commands.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from base_station.autopilots import Rate
from base_station.belief import doubt as doubts
from base_station.commander import UNHEEDED_S, Commander
from base_station.commands import Command, Drive
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.field.safety import Held, permitted
from base_station.gaps import GAP_S, Gap, bridge, out_of_touch_since_s
from base_station.keeping_alive import KeepAlive
from base_station.phases import Arming, Connecting, OnMission, Returning
from base_station.planning.requests import PlanReady, PlanRequest
from base_station.receiving.fleet import LINK_GIVEN_UP_WALL_S, LINK_LOST_WALL_S
from base_station.receiving.preparing import Preparation
from base_station.receiving.telemetry import Frame
from base_station.records import Event, Snapshot
from base_station.snapshots import snapshot
from base_station.steps import deciding
from base_station.steps.probing import get_ready
from hil import mavlink
from hil.scenario import StationView

ABSENT_S = 1.0  # of wall time between two steps: the station itself was not running
CONTACT_GAP_S = 1.0  # two touches of a pair closer in time than this are one


Decide = Callable[[Desk, Frame], Orders]
GetReady = Callable[[Desk, Commander], list[Command]]


@dataclass(frozen=True)
class Outputs:
    """What one step wants done and said."""

    commands: tuple[Command, ...] = ()
    request: PlanRequest | None = None
    events: tuple[Event, ...] = ()
    snapshots: tuple[Snapshot, ...] = ()


class Station:
    """Drives one fleet through the paper's steps [0a]-[4]. `step` never blocks.

    `decide` gives the orders of a tick and moves the phases on; `ready` makes the first tick
    possible; `wants` are rates beyond the usual.
    """

    def __init__(
        self,
        view: StationView,
        decide: Decide | None = None,
        ready: GetReady | None = None,
        wants: tuple[Rate, ...] = (),
    ) -> None:
        self.desk = Desk(view)
        self._decide, self._get_ready = decide or deciding.decide, ready or self._arm_prepared
        self._commander = Commander(view)
        self.autopilots = self._commander.autopilots
        self._preparations = [
            Preparation(m, a, view.clock.telemetry_hz, view.station_sysid, wants)
            for m, a in zip(view.fleet, self.autopilots, strict=True)
        ]
        self._touched_s: dict[tuple[int, int], float] = {}
        self._held: frozenset[Held] = frozenset()
        self._keep_alive = KeepAlive(view.first_on_each_link)
        self._stepped_wall_s: float | None = None
        self._silent: frozenset[int] = frozenset()  # vehicles that have not been heard for long
        self._gap: Gap | None = None

    def interrupted(self) -> None:
        """The station died after its last step, and lives again after a gap."""
        self.desk.say("link", "the station was restarted: it holds the fleet, and goes on")
        if self.desk.watching:
            self._open_gap(self.desk.time_s)

    def step(
        self,
        wall_s: float,
        received: Sequence[tuple[int, mavlink.Received]],
        answers: Sequence[PlanReady] = (),
    ) -> Outputs:
        """Take in what has arrived (fleet index, message), and do what is due.

        `wall_s` is any monotonic clock; it serves pacing and link loss only.
        """
        desk = self.desk
        commands: list[Command] = []
        snapshots: list[Snapshot] = []
        self._excuse_absence(wall_s)
        desk.answers.update({a.number: a for a in answers})
        for index, message in received:
            desk.fleet.receive(index, message, wall_s)
            self._note(index, message)
        desk.time_s = max(desk.time_s, desk.fleet.newest_s)
        self._mind_the_links(wall_s)
        commands += self._keep_alive.due(wall_s, desk.time_s, desk.fleet.worst_loss(desk.time_s))
        if isinstance(desk.phase, Connecting | Arming):
            commands += self._prepare(wall_s)
            commands += self._get_ready(desk, self._commander)
        frames = desk.fleet.due() if desk.watching else []
        if frames and frames[-1].time_s - frames[0].time_s > GAP_S:
            self._open_gap(frames[0].time_s)
        for frame in frames:
            commands += self._tick(frame)
            snapshots.append(snapshot(desk, frame))
        safe = permitted(desk.view, self.autopilots, desk.fleet.tracks, newest(commands))
        self._say_who_is_held(safe.held)
        return Outputs(safe.commands, desk.take_request(), desk.take_events(), tuple(snapshots))

    def _excuse_absence(self, wall_s: float) -> None:
        """Links are not lost while nobody listened to them."""
        before_s, self._stepped_wall_s = self._stepped_wall_s, wall_s
        if before_s is not None and wall_s - before_s > ABSENT_S:
            self.desk.fleet.excuse(wall_s - before_s)

    def _say_who_is_held(self, held: Sequence[Held]) -> None:
        now = frozenset(held)
        for one in sorted(now - self._held, key=lambda h: h.name):
            self.desk.say("link", f"{one.name} is held: {one.reason}")
        if held or self.desk.ended:
            self._held = now

    def _prepare(self, wall_s: float) -> list[Command]:
        commands: list[Command] = []
        for preparation in self._preparations:
            commands += preparation.asks(wall_s)
            for warning in preparation.warnings():
                self.desk.say("link", warning)
        return commands

    def _arm_prepared(self, desk: Desk, commander: Commander) -> list[Command]:
        return get_ready(desk, commander) if all(p.done for p in self._preparations) else []

    def _note(self, index: int, message: mavlink.Received) -> None:
        desk, member = self.desk, self.desk.view.fleet[index]
        if message.sysid != member.sysid:
            return
        self._preparations[index].hear(message.value)
        match message.value:
            case mavlink.CommandAck(command=mavlink.Command.DO_SET_MODE, result=0):
                track = desk.fleet.tracks[index]
                mode = self._commander.acknowledged(index, track, desk.time_s)
                if mode is not None:
                    desk.fleet.mode_acknowledged(index, mode)
            case mavlink.CommandAck(command=command, result=result) if result:
                desk.say("command", f"{member.name} refused command {command} (result {result})")
            case mavlink.StatusText(text=text):
                desk.say("text", f"{member.name}: {text}", sysid=member.sysid)
            case _:
                pass

    def _tick(self, frame: Frame) -> list[Command]:
        desk = self.desk
        silent_since_s = out_of_touch_since_s(desk, frame)
        if silent_since_s is not None:
            self._open_gap(silent_since_s)
        live = desk.fleet.newest_s - frame.time_s < GAP_S / 2
        obeyed, heard = desk.orders, frame
        if self._gap is not None:
            obeyed = self._gap.obeyed(frame, desk.orders, live)
            frame = replace(frame, driven=obeyed.driven)
        alarms = desk.watch.tick(frame, obeyed)
        if desk.doubt is not None and self._gap is None:  # what was obeyed in a gap is a guess
            desk.doubt = doubts.tick(desk.doubt, frame, obeyed, desk.fleet.period_s)
        elif desk.doubt is None and self._gap is None:
            self._take_alarms(alarms)
        self._note_contacts(frame)
        self._let_go_of_the_taken(frame)
        self._give_up_the_unheeding(frame)
        if self._gap is None:
            self._mind_the_time()
            desk.orders = self._decide(desk, frame)
        else:
            self._mind_the_gap(self._gap.at(heard, live), frame)
        return self._commander.carry_out(desk.orders, desk.fleet.tracks, frame.time_s)

    def _open_gap(self, since_s: float) -> None:
        if self._gap is None and not self.desk.ended:
            self._gap = Gap(since_s, self.desk.orders)

    def _mind_the_gap(self, gap: Gap, frame: Frame) -> None:
        """Everybody holds until all are heard again and at rest."""
        self.desk.orders = self.desk.hold()
        over = (gap.is_over(self.desk) and not self._commander.released) or self.desk.ended
        self._gap = None if over else gap
        if over and not self.desk.ended:
            bridge(self.desk, gap, frame)

    def _take_alarms(self, alarms: Sequence[int]) -> None:
        desk, cusum = self.desk, self.desk.watch.cusum
        for i in alarms:
            if i in desk.alarmed or desk.ended:
                continue
            desk.alarm = True
            desk.alarmed[i] = (float(cusum.quiet_since_s[i]), desk.time_s)
            axis = int(cusum.level[i].argmax())
            north_east = ("north", "east")[axis]
            member = desk.view.fleet[i]
            desk.say(
                "anomaly",
                f"{member.name} does not answer as its twin does ({north_east})",
                sysid=member.sysid,
                axis=north_east,
                statistic=round(float(cusum.level[i, axis]), 2),
                threshold=round(desk.watch.threshold, 2),
            )

    def _note_contacts(self, frame: Frame) -> None:
        """A contact is what the believed twin makes of it: no rover here can feel one."""
        for pair in self.desk.watch.contacts:
            if frame.time_s - self._touched_s.get(pair, float("-inf")) > CONTACT_GAP_S:
                a, b = (self.desk.view.fleet[i] for i in pair)
                self.desk.say("contact", f"{a.name} touches {b.name}", sysids=[a.sysid, b.sysid])
            self._touched_s[pair] = frame.time_s

    def give_back(self) -> None:
        """A person says that the vehicles that were taken over may be commanded again.

        Those that are disarmed stay so: a mission goes on when all hold, and are driven if armed.
        """
        back = self._commander.give_back()
        names = ", ".join(self.desk.view.fleet[i].name for i in back) or "nobody"
        self.desk.say("takeover", f"given back: {names}")
        if back and self._gap is not None:
            self._gap = replace(self._gap, standing_since_s=None)

    def _let_go_of_the_taken(self, frame: Frame) -> None:
        for i in self._commander.takeovers(frame.time_s):
            self._commander.released.add(i)
            name = self.desk.view.fleet[i].name
            self.desk.say("takeover", f"{name} was taken over: not commanded any more")
            if self.desk.view.safety is None:
                self.desk.stop("takeover")
            else:  # there is somebody who can give it back
                self._open_gap(frame.time_s)

    def _give_up_the_unheeding(self, frame: Frame) -> None:
        """Nothing is concluded before all stand: one that never does must not keep the others."""
        if not self.desk.ended and (who := self._commander.unheeding(frame.time_s)):
            names = ", ".join(self.desk.view.fleet[i].name for i in who)
            self.desk.stop(f"cannot tell: {names} was told to hold for {UNHEEDED_S:.0f} s, in vain")

    def _mind_the_links(self, wall_s: float) -> None:
        """A vehicle that is not heard is waited for, and only then given up: radios fade."""
        fleet, before = self.desk.fleet, self._silent
        self._silent = frozenset() if self.desk.ended else frozenset(fleet.silent(wall_s))
        if self._silent - before:
            names = ", ".join(self.desk.view.fleet[i].name for i in sorted(self._silent))
            self.desk.say("link", f"no word from {names} for {LINK_LOST_WALL_S:.0f} s")
        if self._silent and fleet.silent(wall_s, LINK_GIVEN_UP_WALL_S):
            self.desk.stop("a link is lost")

    def _mind_the_time(self) -> None:
        desk = self.desk
        if isinstance(desk.phase, OnMission | Returning):
            desk.mission_s += desk.fleet.period_s
            if desk.mission_s > desk.view.limits.mission_timeout_s:
                desk.stop(f"mission not done after {desk.mission_s:.0f} s")


def newest(commands: Sequence[Command]) -> tuple[Command, ...]:
    """Without the set-points that later ones of the same step overtake: nobody obeys old ones."""
    last = {c.sysid: c for c in commands if isinstance(c, Drive)}
    return tuple(c for c in commands if not isinstance(c, Drive) or c is last[c.sysid])
