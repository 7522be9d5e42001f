"""When the station and a vehicle were out of touch: hold, wait, and go on from what is there now.

A gap is there when the station was not running (killed and resumed, or starved) or has not heard
of a vehicle for a while. Through it the twins are moved on under what the vehicles obeyed: their
last set-point, for as long as an autopilot keeps one, then nothing. When all are heard again and
have come to rest, what was believed of the trusted axes is drawn to the reports, the statistic
starts anew, and the mission goes on where it was. So a jump in time does not look like a fault.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from base_station import execution
from base_station.belief import doubt as doubts
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.phases import AnyPhase, Concluding, Experimenting, OnMission, Probing
from base_station.receiving.telemetry import Frame
from base_station.steps.travelling import plan_from_here

GAP_S = 1.0  # of fleet time without reports
SETPOINT_KEPT_S = 3.0  # an autopilot forgets a set-point that is older (ArduPilot: GUIDED)


@dataclass(frozen=True, eq=False)
class Gap:
    """Since when, under which orders, and since when all vehicles have been heard to stand."""

    since_s: float
    orders: Orders
    standing_since_s: float | None = None

    def obeyed(self, frame: Frame, sent: Orders, live: bool) -> Orders:
        """What the vehicles did up to `frame`.

        `sent` reached those that are heard, if the frame is `live`: not one that was waiting for
        a station that did not run.
        """
        count = len(frame.fresh)
        keep = frame.time_s - self.since_s <= SETPOINT_KEPT_S
        before = self.orders if keep else execution.hold(count)
        here = frame.fresh & live
        return Orders(
            np.where(here[:, None], sent.setpoints, before.setpoints),
            np.where(here, sent.driven, before.driven),
        )

    def at(self, frame: Frame, live: bool) -> "Gap":
        if not (live and frame.all_stand):
            return replace(self, standing_since_s=None)
        since_s = frame.time_s if self.standing_since_s is None else self.standing_since_s
        return replace(self, standing_since_s=since_s)

    def is_over(self, desk: Desk) -> bool:
        """Heard, and at rest."""
        return self.standing_since_s is not None and desk.at_rest(self.standing_since_s)


def out_of_touch_since_s(desk: Desk, frame: Frame) -> float | None:
    """Fleet time of the last report of a vehicle that has been silent for too long."""
    last_s = min(track.newest_s() for track in desk.fleet.tracks)
    return last_s if frame.time_s - last_s > GAP_S else None


def bridge(desk: Desk, gap: Gap, frame: Frame) -> None:
    """Anchor what is believed to what is received, and go on."""
    desk.say("link", f"in touch again after {frame.time_s - gap.since_s:.1f} s: going on")
    if isinstance(desk.phase, Probing) and desk.alarmed:
        desk.suspect_the_worst()
    else:
        desk.phase = _resumed(desk, gap, frame.time_s)
    desk.watch.restart(replace(frame, position_m=desk.mean_report_m()))
    if desk.doubt is not None:
        desk.doubt = doubts.anchor(desk.doubt, desk.mean_report_m(desk.doubt.suspect))
    if isinstance(desk.phase, OnMission):
        desk.mission_plans -= 1  # the one that was cut short does not count
        plan_from_here(desk)


def _resumed(desk: Desk, gap: Gap, now_s: float) -> AnyPhase:
    """The phase with its clocks set forward by the gap.

    Half a probe is none, and half an experiment is judged for what it is worth. A policy stopped
    in the middle of a push was never taught to go on from there: the mission is planned again.
    """
    match desk.phase:
        case Probing():
            return Probing(now_s)
        case Experimenting(plan=plan):  # the one that was cut short does not count
            desk.soloed = desk.soloed and not plan.solo
            desk.tries -= not plan.solo
            return Concluding(now_s)
        case phase:
            late_s = now_s - gap.since_s
            clocks = {
                f.name: getattr(phase, f.name) + late_s
                for f in fields(phase)
                if f.name.endswith("_s") and getattr(phase, f.name) is not None
            }
            return replace(phase, **clocks) if clocks else phase
