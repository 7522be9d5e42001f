"""Doubt and diagnosis against a fleet made of the twin itself, whose fault is therefore known."""

import numpy as np
import pytest

from base_station import doubt as doubts
from base_station import twin
from base_station.diagnosis import SAMPLE_PERIOD_S
from base_station.execution import Orders, hold, probe_pulses, pulse_at, pulse_orders
from base_station.hindsight import Hindsight
from base_station.hypotheses import Hypothesis, candidates, nominal
from base_station.telemetry import Frame
from base_station.watch import Baseline, Watch
from hil.scenario import StationView

PERIOD_S = 0.1
SUSPECT = 1


class Plant:
    """A fleet that obeys a twin under one hypothesis, with noise on its reports."""

    def __init__(self, view: StationView, fault: Hypothesis, seed: int = 0) -> None:
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
        report = twin.report(self.state, self.faults)[0]
        noisy = report + 0.015 * self.rng.standard_normal(report.shape)
        return Frame(self.time_s, noisy, np.zeros((3, 2)), np.zeros(3), np.ones(3, dtype=np.bool_))


def _hypothesis(view: StationView, name: str) -> Hypothesis:
    known = candidates(view.fleet[SUSPECT], view.diagnosis.priors)
    return next(h for h in known if h.name == name)


def _probe(view: StationView, name: str, seed: int = 0) -> tuple[Plant, Watch, set[int]]:
    plant = Plant(view, _hypothesis(view, name), seed)
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


def _open(view: StationView, watch: Watch) -> doubts.Doubt:
    hindsight = Hindsight(
        watch.baseline,
        tuple(watch.memory),
        SUSPECT,
        candidates(view.fleet[SUSPECT], view.diagnosis.priors),
        (2.0, 12.0),
        PERIOD_S,
    )
    while not hindsight.take(tuple(watch.memory), most=7):
        pass
    return hindsight.doubt()


@pytest.mark.parametrize("name", ["motor_y_off", "gps_east_stuck"])
def test_the_probe_alarms_on_the_suspect_alone(rescue_view: StationView, name: str) -> None:
    assert _probe(rescue_view, name)[2] == {SUSPECT}


def test_the_probe_does_not_alarm_on_a_healthy_fleet(rescue_view: StationView) -> None:
    assert all(_probe(rescue_view, "none", seed)[2] == set() for seed in range(5))


@pytest.mark.parametrize("name", ["motor_y_off", "gps_east_stuck"])
def test_the_probe_leaves_the_paper_s_two_hypotheses_and_cannot_tell_them_apart(
    rescue_view: StationView, name: str
) -> None:
    doubt = _open(rescue_view, _probe(rescue_view, name)[1])
    posterior = dict(zip([h.name for h in doubt.hypotheses], doubt.posterior, strict=True))
    assert posterior["motor_y_off"] + posterior["gps_east_stuck"] > 0.99
    assert posterior["motor_y_off"] == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("name", ["motor_y_off", "gps_east_stuck"])
def test_a_push_decides(rescue_view: StationView, name: str) -> None:
    plant, watch, _ = _probe(rescue_view, name)
    opened = _open(rescue_view, watch)
    doubt = doubts.anchor(doubts.awake(opened), twin.report(plant.state, plant.faults)[0])
    orders = hold(3)
    orders.driven[0], orders.setpoints[0, :2] = True, (0.0, 0.8)
    for _ in range(50):
        doubt = doubts.tick(doubt, plant.tick(orders), orders, PERIOD_S)
    verdict = doubt.verdict(0.99)
    assert verdict.decided
    assert verdict.hypothesis == name


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
    reckoned_east = doubt.states[index, SUSPECT, twin.EAST]
    report = np.array([[0.0, -2.5], [0.7, 0.4], [0.0, 2.5]])
    state = doubts.anchor(doubt, report).states[index, SUSPECT]
    assert state[twin.NORTH] == 0.7
    assert state[twin.EAST] == reckoned_east
    assert state[twin.HELD_EAST] == 0.4


def test_nominal_has_no_fault(rescue_view: StationView) -> None:
    rows = twin.fault_rows(twin.FleetModel.from_view(rescue_view), [nominal(1)])
    assert rows.power.all()
    assert not rows.gps_stuck.any()
