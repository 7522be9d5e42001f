"""An invented but plausible rescue, told as the station would tell it. Nothing here is measured.

Rover 2 does not answer eastwards. Rover 1 drives into it: reality moves as under `motor_y_off`.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np

from base_station.planning.requests import OpenLoopPlan, PlanProgress, PlanReady, Training
from base_station.recorder import Recorder
from base_station.recording.truth import TruthRecorder
from base_station.records import (
    Array,
    Event,
    Foreseen,
    Phase,
    Snapshot,
    TwinSnapshot,
    VehicleSnapshot,
)
from hil.scenario import Scenario, StationView, load_scenario, station_view

ROOT = Path(__file__).resolve().parents[2]
RATE_HZ = 10
PHASES: tuple[tuple[float, Phase], ...] = (
    (0.0, "connect"),
    (1.0, "arm"),
    (2.0, "probe"),
    (9.0, "plan_alpha"),
    (13.0, "experiment"),
    (21.0, "plan_beta"),
    (29.0, "mission"),
    (52.0, "return"),
    (57.0, "done"),
)
END_S = 60.0
NAMES = ("motor_x_off", "motor_y_off", "gps_north_stuck", "gps_east_stuck", "none")
PRIORS = np.array([0.225, 0.225, 0.225, 0.225, 0.05])
THRESHOLD = 12.0
PLAN_ALPHA_S, EXPERIMENT_S, PLAN_BETA_S = 12.9, 13.0, 28.9


def scenario() -> Scenario:
    return load_scenario(ROOT / "scenarios" / "rescue.yaml")


def view() -> StationView:
    return station_view(scenario(), mavlink_port_base=14550, station_seed=1)


def phase_at(time_s: float) -> Phase:
    return [name for start_s, name in PHASES if start_s <= time_s][-1]


def _ramp(time_s: float, start_s: float, end_s: float) -> float:
    x = min(1.0, max(0.0, (time_s - start_s) / (end_s - start_s)))
    return x * x * (3 - 2 * x)


def _along(time_s: float, legs: list[tuple[float, float, float]]) -> tuple[float, float]:
    """Position at a time on legs (arrival time, north, east)."""
    (_, north, east), start_s = legs[0], legs[0][0]
    for end_s, n, e in legs[1:]:
        share = _ramp(time_s, start_s, end_s)
        north, east, start_s = north + (n - north) * share, east + (e - east) * share, end_s
        if time_s < end_s:
            break
    return north, east


ROVER_1 = [(0, 0, -2.5), (2.5, 0, -2.5), (3, 0.15, -2.5), (3.7, 0.15, -2.35), (13, 0.15, -2.35),
           (17, 0.1, -0.58), (20, 0.1, 0.12), (29, 0.1, 0.12), (31, 0.6, -1.0), (33, 3.0, -1.0),
           (36, 3.0, 0.1), (40, 3.0, 0.92), (46, 4.0, -2.0), (49, 4.0, -3.0)]  # fmt: skip
ROVER_2 = [(0, 0, 0), (5.4, 0, 0), (6, 0.15, 0), (17, 0.15, 0), (20, 0.15, 0.72), (29, 0.15, 0.72),
           (33, 3.0, 0.72), (37, 3.0, 0.72), (40, 3.0, 1.5)]  # fmt: skip
ROVER_3 = [(0, 0, 2.5), (7.5, 0, 2.5), (8, 0.15, 2.5), (8.7, 0.15, 2.65), (13, 0.15, 2.65),
           (18, 0.6, 2.1), (29, 0.6, 2.1), (36, 1.0, 3.5)]  # fmt: skip


def truth_at(time_s: float) -> Array:
    """[3, 2] north and east, m."""
    return np.array([_along(time_s, legs) for legs in (ROVER_1, ROVER_2, ROVER_3)])


def twin_at(name: str, time_s: float) -> tuple[Array, Array]:
    """True and reported positions [3, 2] under a hypothesis."""
    true = truth_at(time_s)
    report = true.copy()
    pulse = 0.15 * _ramp(time_s, 6.3, 6.8)
    if name in ("gps_east_stuck", "none", "motor_x_off"):
        true[1, 1] += pulse
        report[1, 1] += pulse if name != "gps_east_stuck" else 0.0
    if name == "gps_east_stuck":
        report[1, 1] = 0.0
        true[1, 1] += 0.35 * _ramp(time_s, 14, 19)
    if name in ("gps_north_stuck", "motor_x_off"):
        true[1, 0] -= 0.4 * _ramp(time_s, 13, 20)
        report[1, 0] = 0.0
    if name == "none":
        true[1] += [0.5 * _ramp(time_s, 14, 20), 0.4 * _ramp(time_s, 14, 20)]
        report[1] = true[1]
    return true, report


@dataclass
class Belief:
    """Evidence per hypothesis, nats."""

    log_likelihood: Array = field(default_factory=lambda: np.zeros(len(NAMES)))

    def update(self, reported: Array, time_s: float) -> None:
        for k, name in enumerate(NAMES):
            error = (reported - twin_at(name, time_s)[1])[1] / 0.06
            self.log_likelihood[k] -= 0.1 * float(error @ error)

    def posterior(self) -> Array:
        weights = PRIORS * np.exp(self.log_likelihood - self.log_likelihood.max())
        share: Array = 0.98 * weights / weights.sum()
        return share


def snapshots() -> Iterator[Snapshot]:
    random, belief = np.random.default_rng(3), Belief()
    cusum, residual = np.zeros((3, 2)), np.zeros((3, 2))
    plan = plan_alpha().plan
    assert plan is not None
    foreseen = Foreseen(NAMES, plan.predicted_reports)
    for tick in range(int(END_S * RATE_HZ) + 1):
        time_s = tick / RATE_HZ
        phase = phase_at(time_s)
        true = truth_at(time_s)
        velocity = (truth_at(time_s + 0.05) - truth_at(time_s - 0.05)) / 0.1
        reported = true + random.normal(0, 0.02, (3, 2))
        residual = random.normal(0, 1, (3, 2))
        if 6.3 <= time_s < 8.0:
            residual[1, 1] -= 3.5
        cusum = np.maximum(0.0, cusum + abs(residual) - 1.6)
        if time_s > 9.0:
            cusum[1] *= 0.9
            belief.update(reported, time_s)
        twins = _twins(phase, time_s, belief)
        vehicles = tuple(
            _vehicle(k, phase, time_s, reported[k], velocity[k], residual[k], cusum[k])
            for k in range(3)
        )
        under_way = foreseen if phase == "experiment" else None
        yield Snapshot(time_s, phase, THRESHOLD, vehicles, twins, under_way)


def _vehicle(
    k: int, phase: Phase, time_s: float, at: Array, velocity: Array, residual: Array, cusum: Array
) -> VehicleSnapshot:
    moving = float(np.hypot(*velocity)) > 0.02
    setpoint = (float(velocity[0]), float(velocity[1])) if moving else None
    if k == 1 and 6.3 <= time_s < 6.8:
        setpoint = (0.0, 0.5)
    outputs = (velocity[0] / 1.6, velocity[0] / 1.6, velocity[1] / 1.6, velocity[1] / 1.6)
    own = {"probe": "probing", "experiment": "experiment", "mission": "mission"}.get(phase, "idle")
    if k == 1 and 9 <= time_s < 21:
        own = "suspect"
    if k == 0 and phase == "mission" and 33 < time_s < 40:
        own = "helping"
    return VehicleSnapshot(
        sysid=k + 1,
        name=f"rover_{k + 1}",
        phase=own if phase != "done" else "home",
        reported_m=(float(at[0]), float(at[1])),
        velocity_mps=(float(velocity[0]), float(velocity[1])),
        yaw_rad=0.0,
        setpoint_mps=setpoint,
        motor_outputs=tuple(float(u) for u in outputs),
        battery_percent=98.0 - 0.05 * time_s - k,
        gps_satellites=14 - k,
        residual=(float(residual[0]), float(residual[1])),
        cusum=(float(cusum[0]), float(cusum[1])),
    )


def _twins(phase: Phase, time_s: float, belief: Belief) -> tuple[TwinSnapshot, ...]:
    if phase in ("connect", "arm", "probe"):
        true, report = twin_at("none", time_s)
        return (TwinSnapshot("none", 1.0, 0.0, true, report, np.zeros((3, 2)), np.zeros(3)),)
    names = NAMES if time_s < 21.2 else ("motor_y_off",)
    posterior = belief.posterior() if len(names) > 1 else np.ones(1)
    twins = []
    for k, name in enumerate(names):
        true, report = twin_at(name, time_s)
        sigma = np.zeros((3, 2))
        sigma[1] = 0.03 + 0.01 * _ramp(time_s, 13, 20) * (k + 1)
        likelihood = float(belief.log_likelihood[NAMES.index(name)])
        twins.append(
            TwinSnapshot(name, float(posterior[k]), likelihood, true, report, sigma, np.zeros(3))
        )
    return tuple(twins)


def turned(vehicle: VehicleSnapshot, yaw_rad: float) -> VehicleSnapshot:
    return replace(vehicle, yaw_rad=yaw_rad)


def events() -> list[Event]:
    posterior = {"motor_y_off": 0.994, "gps_east_stuck": 0.003, "none": 0.001, "unknown": 0.002}
    said = [Event(start_s, "phase", name) for start_s, name in PHASES]
    said += [
        Event(0.9, "link", "3 vehicles heard, located and ready"),
        Event(7.1, "anomaly", "rover_2 does not answer to the east"),
        Event(9.0, "hypotheses", "rover_2: motor_y_off 0.450, gps_east_stuck 0.450, none 0.050"),
        Event(13.0, "plan", "plan alpha: predicted error 0.004 over 8.0 s"),
        Event(17.1, "contact", "rover_1 pushes rover_2"),
        Event(
            21.0,
            "verdict",
            "rover_2: motor_y_off (motor_y_off 0.994, gps_east_stuck 0.003)",
            {"sysid": 2, "hypothesis": "motor_y_off", "posterior": posterior, "decided": True},
        ),
        Event(29.0, "plan", "plan beta learnt"),
        Event(36.0, "goal", "rover_3 reached its goal", {"sysid": 3}),
        Event(40.0, "goal", "rover_2 reached its goal", {"sysid": 2}),
        Event(49.0, "goal", "rover_1 reached its goal", {"sysid": 1}),
        Event(57.0, "end", "all goals reached"),
    ]
    return sorted(said, key=lambda event: event.time_s)


def progress() -> list[tuple[float, PlanProgress]]:
    """What the planner says, with the sim_time at which it arrives."""
    said = []
    for number, kind, attempt, start_s, end_s, last in (
        (1, "alpha", 0, 9.2, 10.8, 0.35),
        (1, "alpha", 1, 10.8, 12.8, 0.99),
        (2, "beta", 0, 21.2, 28.8, 97.0),
    ):
        for row, (steps, reward) in enumerate(curve(last)):
            time_s = start_s + (end_s - start_s) * row / 40
            said.append((time_s, PlanProgress(number, kind, attempt, int(steps), 40_000, reward)))
    return said


def curve(last: float) -> tuple[tuple[float, float], ...]:
    random = np.random.default_rng(int(100 * last))
    noise = random.normal(0, 0.03, 40)
    return tuple(
        (1000.0 * (k + 1), float(last * (1 - math.exp(-k / 9) + noise[k]))) for k in range(40)
    )


def plan_alpha() -> PlanReady:
    rows = np.linspace(13.0, 21.0, 17)
    reports = np.array([[twin_at(name, t)[1] for t in rows] for name in NAMES])
    plan = OpenLoopPlan(np.zeros((16, 3, 3)), 0.5, (1,), 0.004, reports)
    trainings = (
        Training("ppo-mlp", "tuned", 0, False, 40_000, 1.6, curve(0.35)),
        Training("ppo-mlp", "tuned", 1, True, 40_000, 2.0, curve(0.99)),
    )
    return PlanReady(1, "alpha", trainings, plan)


def plan_beta() -> PlanReady:
    training = Training("ppo-mlp", "tuned", 0, True, 40_000, 7.6, curve(97.0))
    predicted_m = np.array([truth_at(t) for t in np.arange(29.0, 52.0, 0.5)])
    return PlanReady(2, "beta", (training,), predicted_m=predicted_m)


def contacts() -> list[tuple[float, tuple[str, str], tuple[float, float], float]]:
    found = []
    for start_s, end_s in ((17.0, 20.0), (36.8, 40.0)):
        for time_s in np.arange(start_s, end_s, 0.25).tolist():
            a, b, _ = truth_at(time_s)
            middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
            strength = 4.0 if time_s == start_s else 1.2
            found.append((time_s, ("rover_1", "rover_2"), middle, strength))
    return found


def tell(recorder: Recorder, story: list[Snapshot]) -> None:
    """Everything in the order of its time, as the station would."""
    said: list[tuple[float, Callable[[], None]]] = []
    said += [(s.time_s, partial(recorder.snapshot, s)) for s in story]
    said += [(e.time_s, partial(recorder.event, e)) for e in events()]
    said += [(time_s, partial(recorder.progress, p)) for time_s, p in progress()]
    said += [(PLAN_ALPHA_S, partial(recorder.plan, plan_alpha()))]
    said += [(PLAN_BETA_S, partial(recorder.plan, plan_beta()))]
    for _, call in sorted(said, key=lambda row: row[0]):
        call()


def tell_truth(recorder: TruthRecorder, story: list[Snapshot]) -> None:
    """The same run, as the bench would."""
    recorder.fault(0.0, "rover_2: motors 3 and 4 off")
    for snapshot in story:
        places = enumerate(truth_at(snapshot.time_s).tolist(), start=1)
        recorder.truth(snapshot.time_s, {k: (north, east, 0.0) for k, (north, east) in places})
    for contact in contacts():
        recorder.contact(*contact)
