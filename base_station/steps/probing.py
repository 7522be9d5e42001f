"""[0a]: is everybody there, and does everybody answer as its twin does?"""

from base_station import execution, twin
from base_station.belief.watch import Baseline, Watch
from base_station.commander import Commander
from base_station.commands import Command
from base_station.desk import Desk
from base_station.execution import Orders
from base_station.fitted import fleet_model
from base_station.phases import Arming, Connecting, Probing
from base_station.receiving.telemetry import Frame
from base_station.steps.travelling import request_beta

LINK_PATIENCE_S = 10.0


def get_ready(desk: Desk, commander: Commander) -> list[Command]:
    """Wait for all vehicles, arm them in HOLD; then the ticks and the probe begin."""
    tracks = desk.fleet.tracks
    if isinstance(desk.phase, Connecting):
        if not desk.fleet.complete:
            return []
        desk.say("link", f"{len(tracks)} vehicles heard, located and ready")
        desk.enter(Arming())
    commands = commander.carry_out(desk.orders, tracks, desk.time_s)
    commands += commander.arm(tracks, desk.time_s)
    if commander.all_holding(tracks) and _links_will_do(desk):
        desk.fleet.start_ticks()
        desk.watch = fresh_watch(desk)
        desk.enter(Probing(desk.time_s))
    return commands


def _links_will_do(desk: Desk) -> bool:
    """Whether the fleet can be judged by what its links let through; if not for long, hold."""
    limit_s, period_s = desk.view.diagnosis.obeyed_within_s, desk.fleet.period_s
    within_s = [t.obeyed_within_s(desk.time_s, period_s) for t in desk.fleet.tracks]
    slowest = max(range(len(within_s)), key=within_s.__getitem__)
    if within_s[slowest] <= limit_s:
        return True
    told = (
        f"an order to {desk.view.fleet[slowest].name} takes {within_s[slowest]:.2f} s to be surely "
        f"obeyed (limit {limit_s:g} s, diagnosis.obeyed_within_s)"
    )
    if not isinstance(desk.phase, Arming) or desk.phase.standing_since_s is None:
        desk.say("link", f"{told}: waiting for a better link")
        desk.phase = Arming(desk.time_s)
    elif desk.time_s - desk.phase.standing_since_s > LINK_PATIENCE_S:
        desk.stop(f"cannot tell: {told}")
    return False


def fresh_watch(desk: Desk) -> Watch:
    """The believed twin, at rest where the vehicles say they are."""
    newest = [t.samples[-1] for t in desk.fleet.tracks]
    state = twin.initial_state(
        [s.position_m for s in newest], [t.status.yaw_rad for t in desk.fleet.tracks]
    )
    return Watch(desk.view, Baseline(fleet_model(desk.view)), state, desk.time_s)


def probe(desk: Desk, phase: Probing, frame: Frame) -> Orders:
    """Pulse after pulse; then doubt whoever did not answer, or go on to the mission."""
    pulses = execution.pulses_of(desk.view)
    pulse, driven = execution.pulse_at(pulses, frame.time_s - phase.since_s, desk.view)
    if pulse is None:
        if desk.alarmed:
            desk.suspect_the_worst()
        else:
            desk.say("text", "all vehicles answer as their twins do")
            request_beta(desk)
        return desk.hold()
    if not driven:
        return desk.hold()
    return execution.pulse_orders(pulse, float(frame.yaw_rad[pulse.vehicle]), desk.view)
