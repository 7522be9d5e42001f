"""What the station knows and believes, and what it is about to say: the steps work on it."""

import numpy as np
from numpy.typing import NDArray

from base_station import execution, mission
from base_station.belief.diagnosis import Verdict
from base_station.belief.doubt import Doubt
from base_station.belief.fixes import has_fix, seen_m
from base_station.belief.hindsight import Hindsight
from base_station.belief.hypotheses import Hypothesis, candidates
from base_station.belief.watch import Watch
from base_station.execution import Orders
from base_station.phases import AnyPhase, Connecting, Finished, Holding, Settling
from base_station.planning.requests import Kind, PlanReady, PlanRequest
from base_station.receiving.fleet import Fleet
from base_station.receiving.telemetry import Frame
from base_station.records import Event, EventKind
from hil.scenario import StationView

Array = NDArray[np.float64]

STILL_M = 0.04  # between the means of two half seconds of reports
LONG_REST_S = 4.0


class Desk:
    """Plain attributes; events and the plan request wait here for the end of the step."""

    def __init__(self, view: StationView) -> None:
        self.view = view
        self.fleet = Fleet(view)
        self.phase: AnyPhase = Connecting()
        self.time_s = 0.0  # fleet time
        self.orders: Orders = self.hold()
        self.alarm = False  # was there ever one?
        self.alarmed: dict[int, tuple[float, float]] = {}  # vehicle: last quiet, alarm (s)
        self.doubt: Doubt | None = None
        self.verdict: Verdict | None = None
        self.tries = 0  # experiments on the present suspect ...
        self.soloed = False  # ... and whether it has been driven alone
        self.goals = mission.Goals.of(view)
        self.mission_plans = 0
        self.mission_s = 0.0  # on the way, planning not counted
        self.answers: dict[int, PlanReady] = {}
        self._watch: Watch | None = None
        self._requests = 0
        self._request: PlanRequest | None = None
        self._events: list[Event] = []

    @property
    def watching(self) -> bool:
        return self._watch is not None

    @property
    def watch(self) -> Watch:
        """The believed twin; there is one from the first tick on."""
        assert self._watch is not None
        return self._watch

    @watch.setter
    def watch(self, watch: Watch) -> None:
        self._watch = watch

    @property
    def open_doubt(self) -> Doubt:
        """The doubt that the phase is about."""
        assert self.doubt is not None
        return self.doubt

    @property
    def ended(self) -> bool:
        return isinstance(self.phase, Holding | Finished)

    def hold(self) -> Orders:
        return execution.hold(len(self.view.fleet))

    def mean_report_m(self, suspect: int | None = None) -> Array:
        """[V, 2] mean of the last second of reports of the fleet at rest.

        A suspect that is judged by its fixes is where the newest one is: those before it may be
        from when it still rolled.
        """
        frames = self._last_second()
        mean_m = np.asarray(np.nanmean([f.position_m for f in frames], axis=0))
        if suspect is not None and has_fix(frames[-1], suspect):
            mean_m[suspect] = seen_m(frames[-1], suspect)[suspect]
        return mean_m

    def at_rest(self, since_s: float) -> bool:
        """Whether all, in HOLD since then, have rolled out: the mean of their reports says where
        they are. Reports that wander at rest are not waited for for ever."""
        frames = self._last_second()
        waited_s = frames[-1].time_s - since_s
        if waited_s < execution.REST_S:
            return False
        older, newer = np.array_split([f.position_m for f in frames], 2)
        moved_m = np.abs(np.nanmean(newer, axis=0) - np.nanmean(older, axis=0))
        return bool((moved_m < STILL_M).all()) or waited_s >= LONG_REST_S

    def _last_second(self) -> list[Frame]:
        count = round(1.0 / self.fleet.period_s)
        return [moment.frame for moment in list(self.watch.memory)[-count:]]

    def ask(
        self,
        kind: Kind,
        hypotheses: tuple[Hypothesis, ...],
        posterior: tuple[float, ...],
        states: Array,
    ) -> int:
        """Put a request to the planner; returns its number."""
        self._requests += 1
        self._request = PlanRequest(
            number=self._requests,
            kind=kind,
            seed=self.view.station_seed + self._requests,
            preset=self.view.planning.preset,
            hypotheses=hypotheses,
            posterior=posterior,
            states=states,
            delivered=self.goals.settled,
        )
        return self._requests

    def suspect_the_worst(self) -> None:
        """Stop everybody, then doubt the vehicle whose alarm stands out most."""
        level = self.watch.cusum.level.max(axis=1)
        suspect = max(self.alarmed, key=lambda i: float(level[i]))
        hindsight = Hindsight(
            self.watch.baseline,
            tuple(self.watch.memory),
            suspect,
            candidates(self.view.fleet[suspect], self.view.diagnosis.priors),
            self.alarmed[suspect],
            self.fleet.period_s,
        )
        self.enter(Settling(self.time_s, hindsight))

    def enter(self, phase: AnyPhase) -> None:
        if phase.name != self.phase.name:
            self.say("phase", phase.name)
        self.phase = phase

    def stop(self, reason: str) -> None:
        """Hold for good."""
        self.say("end", f"holding: {reason}")
        self.enter(Holding(reason))

    def say(self, kind: EventKind, text: str, **data: object) -> None:
        self._events.append(Event(round(self.time_s, 3), kind, text, data))

    def take_events(self) -> tuple[Event, ...]:
        """What was said since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def take_request(self) -> PlanRequest | None:
        """What the planner was asked since the last call."""
        request, self._request = self._request, None
        return request
