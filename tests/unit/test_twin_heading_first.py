"""The twin of an autopilot that turns its nose to where it is sent, and drives at once."""

import math

import numpy as np
import pytest

from base_station.autopilots import adapter
from base_station.belief.hypotheses import NONE, Hypothesis
from base_station.twin import (
    EAST,
    NORTH,
    V_EAST,
    V_NORTH,
    YAW,
    FleetModel,
    advance,
    fault_rows,
    initial_state,
)
from hil.airframe import SKID_STEER
from hil.faults import Fault, Type, Unit
from hil.scenario import StationView

NAN = math.nan
HEALTHY = Hypothesis(NONE, 1, 1.0)
DEAD = Hypothesis("motor_x_off", 1, 1.0, Fault(Unit.MOTOR, Type.OFF, (1, 2)))


@pytest.fixture
def lone(rescue_view: StationView) -> FleetModel:
    wide = dict.fromkeys(("north_min_m", "east_min_m"), -50.0)
    wide |= dict.fromkeys(("north_max_m", "east_max_m"), 50.0)
    arena = rescue_view.arena.model_copy(update=wide)
    member = rescue_view.fleet[0].model_copy(
        update={"airframe": "skid_steer", "autopilot": "ardupilot"}
    )
    update = {"fleet": (member,), "arena": arena, "yaw": "free"}
    return FleetModel.from_view(rescue_view.model_copy(update=update))


def at_rest(yaw_rad: float = 0.0) -> np.ndarray:
    return initial_state([[[0.0, 0.0]]], [[yaw_rad]])


def run(model, state, setpoint, duration_s, driven=True, hypothesis=HEALTHY):
    faults = fault_rows(model, [hypothesis])
    return advance(model, model.nominal, faults, state, [setpoint], [driven], duration_s).states


@pytest.mark.parametrize("bearing_deg", [0.0, 60.0, -120.0])
def test_it_ends_up_going_where_it_is_sent_as_fast_as_it_is_told(lone, bearing_deg):
    bearing = math.radians(bearing_deg)
    velocity = [0.8 * math.cos(bearing), 0.8 * math.sin(bearing)]
    after = run(lone, at_rest(), [*velocity, NAN], 20.0)[0, 0]
    assert after[[V_NORTH, V_EAST]] == pytest.approx(velocity, abs=0.02)
    assert after[YAW] == pytest.approx(bearing, abs=0.05)


def test_it_drives_on_while_it_turns(lone):
    """Sent back, it leaves in an arc: it does not wait until it looks that way."""
    after = run(lone, at_rest(), [-0.8 * math.cos(0.3), -0.8 * math.sin(0.3), NAN], 1.0)[0, 0]
    assert after[NORTH] > 0.1


def test_with_a_yaw_it_turns_there_and_goes_backwards_too(lone):
    after = run(lone, at_rest(), [-0.5, 0.0, 0.0], 10.0)[0, 0]
    assert after[V_NORTH] == pytest.approx(-0.5, abs=0.02)
    turned = run(lone, at_rest(), [0.0, 0.0, 1.5], 5.0)[0, 0]
    assert turned[YAW] == pytest.approx(1.5, abs=0.05)
    assert turned[[NORTH, EAST]] == pytest.approx([0.0, 0.0], abs=1e-6)


def test_in_hold_its_motors_brake_and_a_dead_drive_rolls(lone):
    state = at_rest()
    state[0, 0, V_NORTH] = 0.8
    braked = run(lone, state, [0.0, 0.0, NAN], 5.0, driven=False)[0, 0, NORTH]
    rolled = run(lone, state, [0.0, 0.0, NAN], 5.0, driven=False, hypothesis=DEAD)[0, 0, NORTH]
    assert rolled == pytest.approx(0.8**2 / (2.0 * 0.06 * 9.80665), rel=0.05)
    # v' = -v k - d: braking by the motors and by rolling resistance
    k = 90.0 / 2.4 / SKID_STEER.mass_kg
    d = SKID_STEER.rolling_force_n / SKID_STEER.mass_kg
    expected_m = (0.8 - d / k * math.log(1.0 + 0.8 * k / d)) / k
    assert braked == pytest.approx(expected_m, abs=0.8 * lone.dt_s)


def test_its_throttle_slews(lone):
    """A step of 1 m/s takes the throttle 1 s per unit: a(t) = F t / m less what drags."""
    helm = adapter("ardupilot", SKID_STEER).helm
    assert helm is not None
    after = run(lone, at_rest(), [1.0, 0.0, NAN], 0.2)[0, 0]
    stall, rolling = SKID_STEER.axis_stall_force_n("x"), SKID_STEER.rolling_force_n
    begins_s = rolling / stall / helm.slew_per_s
    free = stall * helm.slew_per_s / SKID_STEER.mass_kg * (0.2 - begins_s) ** 2 / 2.0
    assert after[V_NORTH] == pytest.approx(free, rel=0.3)


def test_from_rest_it_is_as_fast_as_the_firmware_was(lone):
    """Measured on ArduPilot's rover in our world, told 1 m/s, from when its throttle moved: the
    integral waits for a throttle that slews, so it does not overshoot."""
    at_s, measured = [0.37, 0.57, 0.77, 0.97, 1.17, 1.57, 2.07], [0.16, 0.43, 0.71, 0.85, 0.93]
    state, reached = at_rest(), []
    for after_s in np.diff([0.0, *at_s]):
        state = run(lone, state, [1.0, 0.0, NAN], float(after_s))
        reached.append(float(state[0, 0, V_NORTH]))
    assert reached == pytest.approx([*measured, 0.98, 1.0], abs=0.05)
