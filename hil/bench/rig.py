"""World, vehicles and station in one process over in-memory links: deterministic, in lockstep.

The same bytes that would go over UDP go through memory. One `tick` is one autopilot frame of every
vehicle; the station steps at 20 Hz of simulation time. Time is simulation time throughout.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from base_station.listening import Listener
from base_station.node import Keeper, StationNode
from base_station.planning.planner import plan
from base_station.planning.requests import PlanProgress, PlanReady, PlanRequest, decode, encode
from hil.impairment import impaired
from hil.link import Link, MemoryLink
from hil.mavlink import Signing, Streams, ticks
from hil.physics_link import ServoFrame, decode_state, encode_frame
from hil.scenario import Scenario, StationView
from hil.world.simulation import Advance, Simulation
from sim_vehicles.vehicle import Vehicle

STATION_HZ = 20
EPOCH_US = 1_700_000_000_000_000  # telemetry logs of simulated time start here


Learn = Callable[[StationView, PlanRequest, Callable[[PlanProgress], None]], PlanReady]


class InlinePlanner:
    """Plans at once, delivers after the declared simulation time, and progress on the way there.

    Requests travel as JSON, too.
    """

    def __init__(self, view: StationView, learn: Learn) -> None:
        self._view, self._learn = view, learn
        self._due: list[tuple[float, PlanProgress | PlanReady]] = []
        self.time_s = 0.0

    def submit(self, request: PlanRequest) -> None:
        received = decode(encode(request))
        assert isinstance(received, PlanRequest)
        progress: list[PlanProgress] = []
        answer = decode(encode(self._learn(self._view, received, progress.append)))
        assert isinstance(answer, PlanReady)
        messages: list[PlanProgress | PlanReady] = [*progress, answer]
        step_s = self._view.planning.planning_sim_s / len(messages)
        for k, message in enumerate(messages, start=1):
            self._due.append((self.time_s + k * step_s, message))

    def poll(self) -> list[PlanProgress | PlanReady]:
        due = [message for at_s, message in self._due if at_s <= self.time_s + 1e-9]
        self._due = [entry for entry in self._due if entry[0] > self.time_s + 1e-9]
        return due


@dataclass
class _Seat:
    """A vehicle and its ends of the two links."""

    vehicle: Vehicle
    gcs: Link
    injector: Link
    frames: int = 0
    outputs: tuple[int, ...] = (0,) * 16


class Rig:
    """A scenario in memory. `injector_links` are for whoever breaks things."""

    def __init__(
        self,
        scenario: Scenario,
        view: StationView,
        listeners: Sequence[Listener],
        learn: Learn = plan,
        journal: Keeper | None = None,
        key: bytes | None = None,
    ) -> None:
        self._scenario, self._key = scenario, key
        self.simulation = Simulation(scenario, scenario.seed)
        self.station_links: list[Link] = []
        self._seats: dict[int, _Seat] = {}
        self.injector_links: list[Link] = []
        for v in scenario.fleet:
            ours, theirs = MemoryLink.pair()
            breaker, broken = MemoryLink.pair()
            radio = impaired(theirs, scenario, v.sysid, lambda: self.time_s)
            self._seats[v.sysid] = _Seat(self._vehicle(v.sysid), radio, broken)
            self.station_links.append(ours)
            self.injector_links.append(breaker)
        self.planner = InlinePlanner(view, learn)
        self.node = StationNode(view, self.station_links, self.planner, listeners, journal, key)
        self._send_frames()

    def signing(self) -> Signing | None:
        """For whoever else speaks here, on simulated time; None when nothing is signed."""
        return None if self._key is None else Signing(self._key, 0, self._ticks)

    def _ticks(self) -> int:
        return ticks(EPOCH_US / 1e6 + self.time_s)

    def _vehicle(self, sysid: int) -> Vehicle:
        if self._key is None:
            return Vehicle(self._scenario, sysid)
        key, streams = self._key, Streams()
        return Vehicle(
            self._scenario, sysid, lambda link_id: Signing(key, link_id, self._ticks, streams)
        )

    def vehicle(self, sysid: int) -> Vehicle:
        """For tests that speak to a vehicle as a third party would."""
        return self._seats[sysid].vehicle

    @property
    def time_s(self) -> float:
        return self.simulation.time_s

    def serve(self) -> None:
        """Vehicles handle what has arrived and answer: no time passes."""
        ports: tuple[Literal["gcs", "injector"], ...] = ("gcs", "injector")
        for seat in self._seats.values():
            for port in ports:
                link = seat.gcs if port == "gcs" else seat.injector
                for datagram in link.receive():
                    seat.vehicle.receive(port, datagram)
                for datagram in seat.vehicle.outbox(port):
                    link.send(datagram)

    def run(self) -> Iterator[Advance]:
        """Tick after tick for ever; the caller decides when it is enough."""
        autopilot_hz = self._scenario.clock.autopilot_hz
        ticks_per_step = max(1, autopilot_hz // STATION_HZ)
        tick = 0
        while True:
            advance = self.simulation.advance(float("inf"), self.time_s)
            for sysid, reply in advance.replies:
                self._step_vehicle(self._seats[sysid], reply)
            self.serve()
            self._send_frames()
            tick += 1
            if tick % ticks_per_step == 0:
                self.planner.time_s = self.time_s
                self.node.step(self.time_s, EPOCH_US + round(self.time_s * 1e6))
                self.serve()
            yield advance

    def _step_vehicle(self, seat: _Seat, reply: bytes) -> None:
        state = decode_state(reply)
        assert state is not None
        seat.outputs = seat.vehicle.step(state)

    def _send_frames(self) -> None:
        hz = self._scenario.clock.autopilot_hz
        for sysid, seat in self._seats.items():
            frame = ServoFrame(hz, seat.frames, seat.outputs)
            seat.frames += 1
            self.simulation.receive(sysid, [encode_frame(frame)], self.time_s)
