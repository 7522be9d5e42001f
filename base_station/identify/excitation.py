"""What a vehicle is told so that its answer shows what it is: steps there and back on each axis.

One vehicle after another, all others in HOLD. An axis is over within 80 s; at 1 m/s it takes 1 m.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from base_station import execution
from base_station.autopilots import adapter
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.fitted import latency_s
from base_station.phases import Finished
from base_station.receiving.telemetry import Frame
from hil.frames import body_to_ned, ned_to_body
from hil.scenario import FleetMember, StationView

Array = NDArray[np.float64]

REST_S = 2.0
STEPS = ((1.0, 1.2), (-1.0, 1.2), (0.6, 0.8), (-0.6, 0.8))  # share of the speed, duration (s)
ROUNDS = 18
SPEED_SHARE = 0.8  # of limits.speed_mps
STANDING_S = 30.0  # everybody, at first: the noise of the receivers


@dataclass(frozen=True)
class Tried:
    """One axis of one vehicle as it went: what was sent [N], and what was seen of it [M].

    Speeds and positions are along that body axis; a set-point of NaN is HOLD. `link_s`: how long
    the link took, from a report until what answers it was there.
    """

    index: int
    axis: int  # 0 x, 1 y
    yaw_rad: float
    sent_s: Array
    setpoint_mps: Array
    seen_s: Array
    position_m: Array
    velocity_mps: Array
    link_s: float = 0.0

    def seen_as(self, rows: Array) -> "Tried":
        """With other observations [M, 5]: time, north, east, north and east velocity."""
        during = (rows[:, 0] >= self.sent_s[0]) & (rows[:, 0] <= self.sent_s[-1])
        c, s = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        along = np.array([c, s] if self.axis == 0 else [-s, c])
        seen = rows[during]
        return replace(
            self,
            seen_s=seen[:, 0],
            position_m=seen[:, 1:3] @ along,
            velocity_mps=seen[:, 3:5] @ along,
        )


@dataclass
class _Rows:
    yaw_rad: float
    rows: list[tuple[float, ...]] = field(default_factory=list)


def schedule(speed_mps: float) -> list[tuple[float, float]]:
    """(set-point in m/s, duration in s) of one axis; NaN is HOLD."""
    rest = (float("nan"), REST_S)
    return [rest, *((share * speed_mps, s) for share, s in STEPS * ROUNDS), rest]


class Excitation:
    """Decides for a `Station` in place of its steps; `tried` is complete when it has finished."""

    def __init__(self, view: StationView) -> None:
        self._view = view
        self._schedule = schedule(SPEED_SHARE * view.limits.speed_mps)
        self._axis_s = sum(duration for _, duration in self._schedule)
        self._turns = [(i, axis) for i, m in enumerate(view.fleet) for axis in _axes(m)]
        self._heading_first = [adapter(m.autopilot, m.frame).heading_first for m in view.fleet]
        self._since_s: float | None = None
        self._rows: dict[tuple[int, int], _Rows] = {}

    @property
    def duration_s(self) -> float:
        return STANDING_S + self._axis_s * len(self._turns)

    def decide(self, desk: Desk, frame: Frame) -> Orders:
        """The orders of a tick; at the end everybody holds and the station has finished."""
        if self._since_s is None:
            self._since_s = frame.time_s
        elapsed_s = frame.time_s - self._since_s - STANDING_S + 1e-6
        if elapsed_s < 0.0:
            return desk.hold()
        turn = int(elapsed_s / self._axis_s)
        if turn >= len(self._turns):
            if not desk.ended:
                desk.enter(Finished())
            return desk.hold()
        index, axis = self._turns[turn]
        setpoint_mps = self._due(elapsed_s - turn * self._axis_s)
        rows = self._rows.setdefault((index, axis), _Rows(float(frame.yaw_rad[index])))
        along = ned_to_body(*_pair(frame.position_m[index]), rows.yaw_rad)[axis]
        speed = ned_to_body(*_pair(frame.velocity_mps[index]), rows.yaw_rad)[axis]
        if frame.fresh[index]:
            link_s = float(frame.delay_s[index]) - latency_s(self._view.fleet[index])
            rows.rows.append((frame.time_s, setpoint_mps, along, speed, link_s))
        orders = execution.hold(len(self._view.fleet))
        if setpoint_mps == setpoint_mps:
            body = (setpoint_mps, 0.0) if axis == 0 else (0.0, setpoint_mps)
            orders.setpoints[index, :2] = body_to_ned(*body, rows.yaw_rad)
            if self._heading_first[index]:
                orders.setpoints[index, 2] = rows.yaw_rad  # backwards without turning round
            orders.driven[index] = True
        return orders

    def resting(self, time_s: float) -> frozenset[int]:
        """Vehicles that stand now, and have stood long enough to be at rest."""
        everybody = frozenset(range(len(self._view.fleet)))
        if self._since_s is None:
            return everybody
        elapsed_s = time_s - self._since_s - STANDING_S
        if elapsed_s < 0.0:
            return everybody
        turn = int((elapsed_s + 1e-6) / self._axis_s)
        before = int((elapsed_s - REST_S) / self._axis_s)
        busy = {self._turns[t][0] for t in {turn, max(before, 0)} if t < len(self._turns)}
        return everybody - busy

    def tried(self) -> list[Tried]:
        """What came of it, an entry for each axis."""
        return [
            _tried(index, axis, rows.yaw_rad, np.array(rows.rows))
            for (index, axis), rows in self._rows.items()
            if rows.rows
        ]

    def _due(self, elapsed_s: float) -> float:
        for setpoint_mps, duration_s in self._schedule:
            if elapsed_s < duration_s:
                return setpoint_mps
            elapsed_s -= duration_s
        return float("nan")


def _axes(member: FleetMember) -> tuple[int, ...]:
    """Body axes along which it can be told to go."""
    sideways = bool(member.frame.axis_motors("y")) or member.frame.flight is not None
    return (
        (0, 1) if sideways and not adapter(member.autopilot, member.frame).heading_first else (0,)
    )


def _tried(index: int, axis: int, yaw_rad: float, rows: Array) -> Tried:
    time_s, setpoint, position, velocity, link_s = rows.T
    usual_s = float(np.nanmedian(link_s))
    return Tried(index, axis, yaw_rad, time_s, setpoint, time_s, position, velocity, usual_s)


def _pair(row: Array) -> tuple[float, float]:
    return float(row[0]), float(row[1])
