"""Recorded telemetry through the station's receiving side, detector, twins and diagnosis (pure).

Nothing is planned and nothing is sent: the orders are those that were sent then, by this station or
by others. What the station would decide now is compared with what it decided.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from base_station.belief import doubt as doubts
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.overheard import join, on_one_clock, others_drove
from base_station.phases import (
    Concluding,
    Experimenting,
    PlanningAlpha,
    PlanningBeta,
    Probing,
    Settling,
)
from base_station.planning.requests import OpenLoopPlan
from base_station.receiving.telemetry import Frame
from base_station.records import Event, EventKind
from base_station.sent import SentOrders, sent_orders
from base_station.station import Station
from base_station.steps.diagnosing import conclude, settle
from base_station.steps.probing import get_ready, probe
from hil import mavlink
from hil.scenario import StationView

DECISIONS: tuple[EventKind, ...] = ("anomaly", "hypotheses", "verdict")
SAME_TIME_S = 0.15  # one tick, and rounding
SAME_POSTERIOR = 0.01

Stamped = tuple[int, bytes]  # microseconds, frame


@dataclass(frozen=True)
class Difference:
    """A decision that was taken then, or would be now, or both but not the same."""

    then: Event | None
    now: Event | None

    @property
    def text(self) -> str:
        """For people."""
        if self.then is None or self.now is None:
            told = self.then or self.now
            assert told is not None
            return f"{'only then' if self.then else 'only now'}: {_told(told)}"
        return f"then: {_told(self.then)}; now: {_told(self.now)}"


def replay(view: StationView, frames: Iterable[Stamped]) -> tuple[Event, ...]:
    """What the station decides, given the frames of all links in any order.

    Where others drove, an event of kind 'end' says until when that could be followed.
    """
    decoder = mavlink.Decoder()
    heard = [
        (time_us, message)
        for time_us, frame in sorted(frames, key=lambda stamped: stamped[0])
        for message in decoder.decode(frame)
    ]
    if others_drove(view, heard):
        heard = list(on_one_clock(view, heard))
        following: _Following = _Overhearing(sent_orders(view, heard))
        events = _watched(view, heard, Station(view, following.decide, join), 0.0)
        return tuple(event for event in events if event.kind in (*DECISIONS, "end"))
    following = _Following(sent_orders(view, heard))
    offset_us = _clock_offset_us(heard, view.station_sysid)
    events = _watched(view, heard, Station(view, following.decide, get_ready), offset_us)
    return tuple(event for event in events if event.kind in DECISIONS)


def _watched(
    view: StationView,
    heard: Sequence[tuple[int, mavlink.Received]],
    station: Station,
    offset_us: float,
) -> list[Event]:
    index = {m.sysid: k for k, m in enumerate(view.fleet)}
    events: list[Event] = []
    for time_us, step in groupby(heard, key=lambda stamped: stamped[0]):
        received = [(index[m.sysid], m) for _, m in step if m.sysid in index]
        events += station.step((time_us - offset_us) / 1e6, received).events
    return events


def differences(then: Sequence[Event], now: Sequence[Event]) -> tuple[Difference, ...]:
    """Decisions that are not the same, in order; each kind is compared one by one."""
    found = []
    for kind in DECISIONS:
        old = [e for e in then if e.kind == kind]
        new = [e for e in now if e.kind == kind]
        for k in range(max(len(old), len(new))):
            pair = Difference(*(events[k] if k < len(events) else None for events in (old, new)))
            if pair.then is None or pair.now is None or not _same(pair.then, pair.now):
                found.append(pair)
    return tuple(found)


class _Following:
    """Decides as the log did, wherever the station's own steps would need a plan."""

    def __init__(self, sent: SentOrders) -> None:
        self._sent = sent

    def moves(self, orders: Orders) -> bool:
        """Whether anybody drives; this station rests in HOLD."""
        return bool(orders.driven.any())

    def decide(self, desk: Desk, frame: Frame) -> Orders:
        """The orders sent at this tick; the phases follow them."""
        orders = self._sent.at(frame.time_s)
        moving = self.moves(orders)
        match desk.phase:
            case Probing() as phase:
                own = probe(desk, phase, frame)
                if isinstance(desk.phase, Probing) and (own.driven != orders.driven).any():
                    desk.enter(PlanningBeta(0))  # these vehicles were not probed, just driven
            case Settling() as phase:
                settle(desk, phase, frame)
            case PlanningAlpha():
                if self.moves(self._sent.at(frame.time_s + desk.fleet.period_s)):
                    desk.doubt = doubts.anchor(
                        doubts.awake(desk.open_doubt), desk.mean_report_m(desk.open_doubt.suspect)
                    )
                    desk.enter(Experimenting(_in_the_log(len(desk.view.fleet)), frame.time_s))
            case Experimenting(since_s=since_s):
                if not moving and frame.time_s > since_s:
                    desk.enter(Concluding(frame.time_s))
            case Concluding() as phase:
                conclude(desk, phase, frame)
            case PlanningBeta():
                if desk.alarmed and not moving:
                    desk.suspect_the_worst()
            case _:
                pass
        return orders


class _Overhearing(_Following):
    """Others may rest in GUIDED, drive on in spite of a doubt, and drive in ways unknown here."""

    def moves(self, orders: Orders) -> bool:
        return bool(orders.driven.any() and np.any(orders.setpoints[orders.driven, :2]))

    def decide(self, desk: Desk, frame: Frame) -> Orders:
        if not desk.ended and (unknown := self._sent.unknown(frame.time_s)):
            who, why = unknown
            desk.stop(f"{desk.view.fleet[who].name} {why}: what moves it is not in the log")
        orders = self._sent.at(frame.time_s)
        if isinstance(desk.phase, Settling) and self.moves(orders):
            desk.enter(PlanningBeta(0))  # once more when they are at rest
        told_to_move = (orders.setpoints[:, :2] != 0.0).any(axis=1)
        return super().decide(desk, replace(frame, driven=frame.driven & told_to_move))


def _in_the_log(vehicles: int) -> OpenLoopPlan:
    """Stands for a plan whose set-points are in the log."""
    nothing = np.zeros((0, vehicles, 3))
    return OpenLoopPlan(nothing, 1.0, (), float("nan"), nothing[None, :, :, :2])


def _clock_offset_us(heard: Sequence[tuple[int, mavlink.Received]], station_sysid: int) -> float:
    """Log time minus the station's clock, which its TIMESYNC requests carry; else 0."""
    for time_us, message in heard:
        match message.value:
            case mavlink.Timesync(tc1_ns=0, ts1_ns=asked_ns) if message.sysid == station_sysid:
                return time_us - asked_ns / 1e3
            case _:
                pass
    return 0.0


def _same(then: Event, now: Event) -> bool:
    if abs(then.time_s - now.time_s) > SAME_TIME_S:
        return False
    if any(then.data.get(k) != now.data.get(k) for k in ("sysid", "axis", "hypothesis", "decided")):
        return False
    old, new = _posterior(then), _posterior(now)
    return old.keys() == new.keys() and all(
        abs(old[name] - new[name]) <= SAME_POSTERIOR for name in old
    )


def _posterior(event: Event) -> Mapping[str, Any]:
    posterior = event.data.get("posterior", {})
    return posterior if isinstance(posterior, Mapping) else {}


def _told(event: Event) -> str:
    return f"{event.kind} at {event.time_s:.1f} s, {event.text}"
