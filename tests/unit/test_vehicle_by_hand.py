"""A person flies a quadcopter: sticks in STABILIZE, arming there, taking over and letting go."""

import math

import pytest
from vehicle_world import InWorld, scenario

from hil.airframe import GRAVITY_MPS2, QUAD_X
from hil.mavlink import (
    Command,
    CommandAck,
    CopterMode,
    Encoder,
    Heartbeat,
    ManualControl,
    Message,
    MessageId,
    RcChannels,
    RcOverride,
    Result,
    StatusText,
)

PERSON = Encoder(245, 190)
NAN = float("nan")
AIR_KGPM3 = 1.225
HOVER, BOTTOM = 0.5, 0.0  # MANUAL_CONTROL z
assert QUAD_X.flight is not None
TILT_LIMIT_RAD = QUAD_X.flight.tilt_limit_rad


def sticks(
    ahead: float = 0.0, right: float = 0.0, throttle: float = HOVER, turn: float = 0.0
) -> ManualControl:
    return ManualControl(1, ahead, right, throttle, turn)


def ordered(world: InWorld, command: int, *params: float) -> int:
    world.clear()
    world.tell(PERSON.command_long(1, command, *params))
    return world.sent(CommandAck)[-1].result


def by_hand(world: InWorld, message: Message, seconds: float) -> None:
    """A person repeats a message each 0.1 s."""
    for _ in range(round(seconds / 0.1)):
        world.tell(PERSON.encode(message))
        world.run(0.1)


@pytest.fixture
def ground() -> InWorld:
    """In STABILIZE, disarmed."""
    world = InWorld(scenario("quad_x"))
    world.run(1.5)
    assert ordered(world, Command.DO_SET_MODE, 1.0, float(CopterMode.STABILIZE)) == 0
    return world


@pytest.fixture
def quad() -> InWorld:
    """At 10 m, in GUIDED."""
    world = InWorld(scenario("quad_x"))
    world.guided()
    assert ordered(world, Command.NAV_TAKEOFF, 0, 0, 0, NAN, 0, 0, 10.0) == Result.ACCEPTED
    world.run(15.0)
    return world


def taken_over(world: InWorld) -> InWorld:
    mode = (Command.DO_SET_MODE, 1.0, float(CopterMode.STABILIZE))
    assert ordered(world, *mode) == Result.ACCEPTED
    return world


def acceleration(world: InWorld, seconds: float = 0.4) -> tuple[float, float]:
    """North and east (m/s2), with what the air takes added again."""
    before = world.truth()
    for _ in range(round(seconds / 0.02)):
        world._frame()
    after = world.truth()
    speed = (before.north_mps + after.north_mps) / 2, (before.east_mps + after.east_mps) / 2
    drag = AIR_KGPM3 / 2 * QUAD_X.drag_area_m2 / QUAD_X.mass_kg * math.hypot(*speed)
    north = (after.north_mps - before.north_mps) / seconds + drag * speed[0]
    return north, (after.east_mps - before.east_mps) / seconds + drag * speed[1]


@pytest.mark.parametrize(
    ("ahead", "right"), [(0.5, 0.0), (0.0, 0.5), (-0.5, 0.0), (0.0, -0.8), (0.3, 0.3)]
)
def test_a_tilt_accelerates_by_g_times_its_tangent(
    quad: InWorld, ahead: float, right: float
) -> None:
    by_hand(taken_over(quad), sticks(ahead, right), 1.2)
    north, east = acceleration(quad)
    roll, pitch, _ = quad.states[1].attitude_rad
    assert (-pitch, roll) == pytest.approx(
        (ahead * TILT_LIMIT_RAD, right * TILT_LIMIT_RAD), abs=0.01
    )
    expected = (GRAVITY_MPS2 * math.tan(-pitch), GRAVITY_MPS2 * math.tan(roll))
    assert (north, east) == pytest.approx(expected, rel=0.05, abs=0.1)


def test_full_sticks_tilt_to_the_limit(quad: InWorld) -> None:
    by_hand(taken_over(quad), sticks(1.0, 1.0), 1.5)
    roll, pitch, _ = quad.states[1].attitude_rad
    assert math.hypot(roll, pitch) == pytest.approx(TILT_LIMIT_RAD, abs=math.radians(1.5))


def test_the_middle_of_the_throttle_hovers_and_tilting_keeps_the_height(quad: InWorld) -> None:
    by_hand(taken_over(quad), sticks(), 3.0)
    assert abs(quad.truth().down_mps) < 0.15
    by_hand(quad, sticks(ahead=0.6), 1.5)
    assert abs(quad.truth().down_mps) < 0.4


@pytest.mark.parametrize("throttle", [0.4, 0.6])
def test_the_throttle_is_thrust(quad: InWorld, throttle: float) -> None:
    """Newton: (T - m g) / m, with T from the stick; the rotors follow within a frame."""
    taken_over(quad)
    stick, most_n = 2.0 * throttle - 1.0, 4 * QUAD_X.motors[0].stall_force_n
    thrust_n = QUAD_X.weight_n * (1.0 + stick)
    if stick > 0.0:
        thrust_n = QUAD_X.weight_n + stick * (most_n - QUAD_X.weight_n)
    quad.tell(PERSON.encode(sticks(throttle=throttle)))
    quad.run(0.1)
    before_mps = quad.truth().down_mps
    quad.run(0.3)
    climb = (before_mps - quad.truth().down_mps) / 0.3
    assert climb == pytest.approx((thrust_n - QUAD_X.weight_n) / QUAD_X.mass_kg, rel=0.06)


def test_the_turn_stick_turns(quad: InWorld) -> None:
    by_hand(taken_over(quad), sticks(turn=0.5), 3.0)
    assert quad.states[1].gyro_radps[2] == pytest.approx(0.5, abs=0.05)


def test_channels_have_the_same_axes(quad: InWorld) -> None:
    left = RcOverride(1, 1, (1400, 1500, 1500, 1500, *(65535,) * 4, *(0,) * 10))
    by_hand(taken_over(quad), left, 1.0)
    assert quad.states[1].attitude_rad[0] == pytest.approx(-0.2 * TILT_LIMIT_RAD, abs=0.01)
    forward = RcOverride(1, 1, (1500, 1300, 65535, 1500, *(65535,) * 4, *(0,) * 10))
    by_hand(quad, forward, 1.0)
    assert quad.states[1].attitude_rad[1] == pytest.approx(-0.4 * TILT_LIMIT_RAD, abs=0.01)
    quad.tell(PERSON.request_message(1, MessageId.RC_CHANNELS))
    assert quad.sent(RcChannels)[-1].channels_us == (1500, 1300, 1500, 1500)


def test_a_released_throttle_stays_where_it_was(quad: InWorld) -> None:
    up = RcOverride(1, 1, (65535, 65535, 1600, 65535, *(65535,) * 4, *(0,) * 10))
    by_hand(taken_over(quad), up, 0.5)
    quad.tell(PERSON.encode(RcOverride(1, 1, (65535, 65535, 0, 65535, *(65535,) * 14))))
    quad.tell(PERSON.request_message(1, MessageId.RC_CHANNELS))
    assert quad.sent(RcChannels)[-1].channels_us[2] == 1600


def test_a_flight_by_hand_from_the_ground_to_the_ground(ground: InWorld) -> None:
    assert ordered(ground, Command.COMPONENT_ARM_DISARM, 1.0) == Result.ACCEPTED
    by_hand(ground, sticks(throttle=BOTTOM), 2.0)
    assert ground.truth().down_m == 0.0
    by_hand(ground, sticks(throttle=0.6), 1.0)
    assert ground.truth().down_m < -0.5
    by_hand(ground, sticks(throttle=0.48), 4.0)
    by_hand(ground, sticks(throttle=BOTTOM), 3.0)
    assert ground.truth().down_m == 0.0
    assert ground.sent(Heartbeat)[-1].armed
    assert max(ground.pwm[1][:4]) < 1200  # idle
    assert ordered(ground, Command.COMPONENT_ARM_DISARM, 0.0) == Result.ACCEPTED


def test_ten_seconds_on_the_ground_disarm(ground: InWorld) -> None:
    """DISARM_DELAY: counted anew after each landing; the throttle has to stay at the bottom."""
    assert ordered(ground, Command.COMPONENT_ARM_DISARM, 1.0) == Result.ACCEPTED
    by_hand(ground, sticks(throttle=BOTTOM), 9.0)
    by_hand(ground, sticks(throttle=0.6), 1.0)
    by_hand(ground, sticks(throttle=0.48), 4.0)
    by_hand(ground, sticks(throttle=BOTTOM), 9.0)
    assert ground.truth().down_m == 0.0
    assert ground.sent(Heartbeat)[-1].armed
    by_hand(ground, sticks(throttle=BOTTOM), 6.0)
    assert not ground.sent(Heartbeat)[-1].armed
    assert ground.pwm[1][:4] == (0, 0, 0, 0)
    assert ground.sent(StatusText)[-1].text == "Throttle disarmed"


@pytest.mark.parametrize(("delay_s", "armed_s"), [(3.0, 3.0), (0.0, 12.0)])
def test_how_long_it_stays_armed_on_the_ground_in_guided(delay_s: float, armed_s: float) -> None:
    world = InWorld(scenario("quad_x"))
    world.tell(PERSON.param_set(1, "DISARM_DELAY", delay_s))
    world.guided()
    world.run(armed_s - 0.1)
    assert world.vehicles[1].parameters["DISARM_DELAY"] == delay_s
    world.run(1.0)
    beats = world.sent(Heartbeat)
    assert any(b.armed for b in beats)
    assert beats[-1].armed == (delay_s == 0.0)


def test_nobody_at_the_sticks_stays_on_the_ground(ground: InWorld) -> None:
    assert ordered(ground, Command.COMPONENT_ARM_DISARM, 1.0) == Result.ACCEPTED
    ground.run(5.0)
    assert ground.truth().down_m == 0.0


def test_arming_with_the_throttle_up_is_refused(ground: InWorld) -> None:
    ground.tell(PERSON.encode(sticks()))
    assert ordered(ground, Command.COMPONENT_ARM_DISARM, 1.0) == Result.FAILED
    assert [t.text for t in ground.sent(StatusText)] == ["Arm: Throttle too high"]
    ground.tell(PERSON.encode(sticks(throttle=BOTTOM)))
    assert ordered(ground, Command.COMPONENT_ARM_DISARM, 1.0) == Result.ACCEPTED


def test_a_takeover_wins_over_set_points_and_can_be_given_back(quad: InWorld) -> None:
    quad.run(3.0, {1: (1.0, 0.0, 0.0)})
    taken_over(quad)
    for _ in range(20):
        quad.tell(PERSON.encode(sticks(ahead=-0.5)))
        quad.run(0.1, {1: (1.0, 0.0, 0.0)})
    assert quad.truth().north_mps < -1.0
    assert ordered(quad, Command.DO_SET_MODE, 1.0, float(CopterMode.GUIDED)) == Result.ACCEPTED
    quad.run(10.0, {1: (1.0, 0.0, 0.0)})
    assert quad.truth().north_mps == pytest.approx(1.0, abs=0.2)


def test_sticks_do_nothing_in_guided(quad: InWorld) -> None:
    by_hand(quad, sticks(ahead=1.0, throttle=1.0), 2.0)
    assert abs(quad.truth().north_mps) < 0.3
    assert quad.truth().down_m == pytest.approx(-10.0, abs=0.3)


@pytest.mark.parametrize("moves_sticks", [True, False])
def test_letting_go_lands(quad: InWorld, moves_sticks: bool) -> None:
    taken_over(quad)
    if moves_sticks:
        by_hand(quad, sticks(), 1.0)
    quad.run(3.2)
    assert "Radio Failsafe: Land" in [t.text for t in quad.sent(StatusText)]
    quad.run(1.0)
    assert quad.sent(Heartbeat)[-1].custom_mode == CopterMode.LAND
    quad.run(20.0)
    assert quad.truth().down_m == 0.0
    assert not quad.sent(Heartbeat)[-1].armed
