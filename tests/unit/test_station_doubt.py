"""Doubt and diagnosis against a fleet made of the twin itself, whose fault is therefore known."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from base_station import twin
from base_station.belief import doubt as doubts
from base_station.belief import escalation
from base_station.belief.diagnosis import SAMPLE_PERIOD_S
from base_station.belief.hindsight import Hindsight
from base_station.belief.hypotheses import Hypothesis, candidates, nominal
from base_station.belief.particles import report_faults
from base_station.belief.watch import Baseline, Moment, Watch
from base_station.execution import Orders, hold, plan_orders, probe_pulses, pulse_at, pulse_orders
from base_station.receiving.telemetry import Frame
from hil.scenario import StationView

PERIOD_S = 0.1
SUSPECT = 1
STRUCK_S = 3.0  # before the suspect's turn


class Plant:
    """A fleet that obeys a twin under one hypothesis, with noise on its reports.

    What is wrong with reports alone is wrong from STRUCK_S on.
    """

    def __init__(self, view: StationView, fault: Hypothesis, seed: int = 0) -> None:
        self.reports = report_faults([fault], np.full(1, 0.5))
        self.size = fault.fault.size if fault.fault else ()
        self.past_m: list[NDArray[np.float64]] = []
        self.model = twin.FleetModel.from_view(view)
        self.faults = twin.fault_rows(self.model, [fault])
        starts = [[0.0, -2.5], [0.0, 0.0], [0.0, 2.5]]
        self.state = twin.initial_state(starts, [0.0] * 3)[None]
        self.rng = np.random.default_rng(seed)
        self.time_s = 0.0

    def tick(self, orders: Orders) -> Frame:
        self.state = twin.advance(
            self.model,
            self.model.nominal,
            self.faults,
            self.state,
            orders.setpoints,
            orders.driven,
            PERIOD_S,
        ).states
        self.time_s += PERIOD_S
        self.past_m.append(twin.report(self.state, self.faults)[0])
        report = self.past_m[-1].copy()
        since_s = self.time_s - STRUCK_S
        if since_s >= 0.0:
            report[SUSPECT] = self._falsified(since_s)
        noisy = report + 0.015 * self.rng.standard_normal(report.shape)
        still, none, fresh = np.zeros((3, 2)), np.zeros(3), np.ones(3, dtype=np.bool_)
        link = none, none, none
        return Frame(self.time_s, noisy, still, none, fresh, fresh, *link, orders.driven)

    def _falsified(self, since_s: float) -> NDArray[np.float64]:
        late = round(float(self.reports.lag_s[0]) / PERIOD_S)
        report_m = self.past_m[-1 - late][SUSPECT].copy()
        settling_s = self.reports.settling_s[0]
        if np.isfinite(settling_s):
            report_m += (1.0 - np.exp(-since_s / settling_s)) * np.array(self.size[:2])
        elif self.reports.drift_mps[0]:
            report_m += since_s * np.array(self.size[:2])
        report_m += self.reports.noise_m[0] * self.rng.standard_normal(2)
        return report_m


def _hypothesis(view: StationView, name: str, size: tuple[float, ...] = ()) -> Hypothesis:
    known = candidates(view.fleet[SUSPECT], view.diagnosis.priors)
    hypothesis = next(h for h in known if h.name == name)
    return hypothesis.sized(*size) if size else hypothesis


def _probe(
    view: StationView, name: str, seed: int = 0, size: tuple[float, ...] = ()
) -> tuple[Plant, Watch, set[int]]:
    plant = Plant(view, _hypothesis(view, name, size), seed)
    watch = Watch(view, Baseline(plant.model), plant.state[0].copy(), 0.0)
    pulses, alarmed = probe_pulses(3), set()
    orders, time_s = hold(3), 0.0
    while True:
        alarmed |= set(watch.tick(plant.tick(orders), orders))
        pulse, driven = pulse_at(pulses, time_s, view)
        if pulse is None:
            return plant, watch, alarmed
        orders = pulse_orders(pulse, 0.0, view) if driven else hold(3)
        time_s += PERIOD_S


def _open(
    view: StationView, watch: Watch, memory: tuple[Moment, ...] | None = None
) -> doubts.Doubt:
    memory = tuple(watch.memory) if memory is None else memory
    hindsight = Hindsight(
        watch.baseline,
        memory,
        SUSPECT,
        candidates(view.fleet[SUSPECT], view.diagnosis.priors),
        (2.0, 12.0),
        PERIOD_S,
    )
    while not hindsight.take(memory, most=7):
        pass
    return hindsight.doubt()


def _after_solo(
    view: StationView, name: str, size: tuple[float, ...] = ()
) -> tuple[Plant, doubts.Doubt]:
    """Probed, then driven alone as far as that is worth it."""
    plant, watch, _ = _probe(view, name, size=size)
    at_rest_m = np.mean([m.frame.position_m for m in list(watch.memory)[-10:]], axis=0)
    doubt = doubts.anchor(doubts.awake(_open(view, watch)), at_rest_m)
    plan = escalation.solo(doubt, view)
    if plan is None:
        return plant, doubt
    elapsed_s = 0.0
    while (orders := plan_orders(plan, elapsed_s)) is not None:
        doubt = doubts.tick(doubt, plant.tick(orders), orders, PERIOD_S)
        elapsed_s += PERIOD_S
    return plant, doubt


def _posterior(doubt: doubts.Doubt) -> dict[str, float]:
    return {h.name: float(p) for h, p in zip(doubt.hypotheses, doubt.posterior, strict=True)}


@pytest.mark.parametrize("name", ["motor_y_off", "gps_east_stuck"])
def test_the_probe_alarms_on_the_suspect_alone(rescue_view: StationView, name: str) -> None:
    assert _probe(rescue_view, name)[2] == {SUSPECT}


def test_the_probe_does_not_alarm_on_a_healthy_fleet(rescue_view: StationView) -> None:
    assert all(_probe(rescue_view, "none", seed)[2] == set() for seed in range(5))


@pytest.mark.parametrize("name", ["motor_y_off", "gps_east_stuck"])
def test_the_probe_leaves_what_it_cannot_tell_apart(rescue_view: StationView, name: str) -> None:
    """A slow pulse of a weak motor is friction's; the other axis was probed before, maybe."""
    posterior = _posterior(_open(rescue_view, _probe(rescue_view, name)[1]))
    left = {"motor_y_off", "motor_y_partial", "gps_east_stuck", "gps_stuck"}
    assert sum(posterior[n] for n in left) > 0.99
    assert 0.3 < posterior["motor_y_off"] + posterior["motor_y_partial"] < 0.8


@pytest.mark.parametrize("name", ["motor_y_off", "gps_east_stuck"])
def test_the_suspect_alone_leaves_the_paper_s_two_hypotheses_and_a_push_decides(
    rescue_view: StationView, name: str
) -> None:
    plant, doubt = _after_solo(rescue_view, name)
    posterior = _posterior(doubt)
    assert posterior["motor_y_off"] + posterior["gps_east_stuck"] > 0.99
    assert 0.1 < posterior["motor_y_off"] < 0.9
    doubt = doubts.anchor(doubts.awake(doubt), twin.report(plant.state, plant.faults)[0])
    orders = hold(3)
    orders.driven[0], orders.setpoints[0, :2] = True, (0.0, 0.8)
    for _ in range(50):
        doubt = doubts.tick(doubt, plant.tick(orders), orders, PERIOD_S)
    verdict = doubt.verdict(0.99)
    assert verdict.decided
    assert verdict.hypothesis == name


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("motor_y_partial", (0.6,)),
        ("motor_x_partial", (0.4,)),
        ("motor_y_reversed", ()),
        ("gps_stuck", ()),
        ("gps_offset", (0.8, -0.5, 0.0)),
        ("gps_drift", (0.05, 0.1, 0.0)),
        ("gps_noise", (0.4,)),
        ("gps_delay", (0.8,)),
    ],
)
def test_each_fault_is_named_and_its_size_estimated(
    rescue_view: StationView, name: str, size: tuple[float, ...]
) -> None:
    _, doubt = _after_solo(rescue_view, name, size)
    index = [h.name for h in doubt.hypotheses].index(name)
    assert doubt.posterior.argmax() == index
    assert doubt.posterior[index] > 0.9
    fault = doubt.estimated(index).fault
    assert fault is not None
    assert fault.size == pytest.approx(size, abs=0.25 * max(size, default=1.0))


def test_driving_the_suspect_alone_tells_nothing(rescue_view: StationView) -> None:
    """D = 0 on predicted telemetry: the paper's reason for a group manoeuvre."""
    plant, watch, _ = _probe(rescue_view, "motor_y_off")
    doubt = doubts.anchor(_open(rescue_view, watch), twin.report(plant.state, plant.faults)[0])
    before = doubt.posterior[:2]
    orders = hold(3)
    orders.driven[SUSPECT], orders.setpoints[SUSPECT, :2] = True, (0.0, 0.3)
    for _ in range(20):
        doubt = doubts.tick(doubt, plant.tick(orders), orders, PERIOD_S)
    assert doubt.posterior[:2] == pytest.approx(before, abs=0.1)


def test_what_no_twin_explains_is_unknown(rescue_view: StationView) -> None:
    """The suspect drifts north by itself while everybody holds."""
    plant, watch, _ = _probe(rescue_view, "motor_y_off")
    report = twin.report(plant.state, plant.faults)[0]
    doubt = doubts.anchor(doubts.awake(_open(rescue_view, watch)), report)
    for k in range(60):
        frame = plant.tick(hold(3))
        frame.position_m[SUSPECT, 0] += 0.05 * k
        doubt = doubts.tick(doubt, frame, hold(3), PERIOD_S)
    assert doubt.verdict(0.99).hypothesis == "unknown"


def test_evidence_is_taken_at_the_declared_rate_only(rescue_view: StationView) -> None:
    plant, watch, _ = _probe(rescue_view, "motor_y_off")
    doubt = doubts.anchor(_open(rescue_view, watch), twin.report(plant.state, plant.faults)[0])
    changes = 0
    for _ in range(50):
        after = doubts.tick(doubt, plant.tick(hold(3)), hold(3), PERIOD_S)
        changes += not np.array_equal(after.log_weights, doubt.log_weights)
        doubt = after
    assert changes == pytest.approx(50 * PERIOD_S / SAMPLE_PERIOD_S, abs=1)


def test_an_anchor_believes_trusted_axes_and_keeps_the_reckoning_on_stuck_ones(
    rescue_view: StationView,
) -> None:
    doubt = _open(rescue_view, _probe(rescue_view, "gps_east_stuck")[1])
    index = [h.name for h in doubt.twins].index("gps_east_stuck")
    rows = slice(index, None, len(doubt.twins))
    reckoned_east = doubt.states[rows, SUSPECT, twin.EAST]
    report = np.array([[0.0, -2.5], [0.7, 0.4], [0.0, 2.5]])
    states = doubts.anchor(doubt, report).states[rows, SUSPECT]
    assert (states[:, twin.NORTH] == 0.7).all()
    assert set(states[:, twin.EAST]) <= set(reckoned_east)
    assert (states[:, twin.HELD_EAST] == 0.4).all()


def test_nominal_has_no_fault(rescue_view: StationView) -> None:
    rows = twin.fault_rows(twin.FleetModel.from_view(rescue_view), [nominal(1)])
    assert rows.power.all()
    assert not rows.gps_stuck.any()


def test_ordinary_driving_by_a_troubled_link_decides_nothing(rescue_view: StationView) -> None:
    """The order of what is likely stays; how likely does not."""
    _, watch, _ = _probe(rescue_view, "gps_east_stuck")
    sure = _open(rescue_view, watch)
    weights = np.where(np.arange(len(sure.hypotheses)) == 1, 0.0, -50.0 - 1.0 * sure.log_weights)
    sure = replace(sure, prior=sure.prior + weights - sure.log_weights)
    asked = doubts.questioned(sure)
    assert sure.posterior.max() > 0.999
    assert asked.posterior.max() == pytest.approx(doubts.PASSIVE_AT_MOST)
    assert asked.posterior.argsort().tolist() == sure.posterior.argsort().tolist()
    assert doubts.questioned(asked).posterior.max() < doubts.PASSIVE_AT_MOST


def test_a_report_that_is_missing_when_the_replay_begins_spoils_nothing(
    rescue_view: StationView,
) -> None:
    _, watch, _ = _probe(rescue_view, "motor_y_off")
    memory = []
    for moment in watch.memory:
        frame = moment.frame
        if frame.time_s < 2.0:
            there, fresh = frame.position_m.copy(), frame.fresh.copy()
            there[SUSPECT], fresh[SUSPECT] = np.nan, False
            frame = replace(frame, position_m=there, fresh=fresh)
        memory.append(replace(moment, frame=frame))
    doubt = _open(rescue_view, watch, tuple(memory))
    assert doubt.posterior.sum() == pytest.approx(1.0)
    assert np.argmax(doubt.posterior) == np.argmax(_open(rescue_view, watch).posterior)
