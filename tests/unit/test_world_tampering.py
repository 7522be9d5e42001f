"""Faults applied by the world: what they do is what a vehicle would do to itself; nobody knows."""

import pytest
from fault_vocabulary import EXAMPLES
from vehicle_world import InWorld, Velocity, scenario

from hil.airframe import OMNI_PLUS, QUAD_X
from hil.faults import WORLD_KINDS, FailureType, Fault, Injection, Unit, to_clearing, to_injection
from hil.mavlink import EscTelemetry, MessageId, ServoOutputs, StatusText, SysStatus
from hil.physics_link import PhysicsState
from hil.scenario import FaultModel
from hil.world.orders import Break, Mend
from hil.world.tampering import Tampering

NORTH: Velocity = (0.5, 0.0, 0.0)
SOUTH: Velocity = (-0.5, 0.0, 0.0)
REST: Velocity = (0.0, 0.0, 0.0)
CAN = [EXAMPLES[kind] for kind in WORLD_KINDS]
AIRFRAMES = {"omni_plus": OMNI_PLUS, "quad_x": QUAD_X}


def driving() -> InWorld:
    world = InWorld(scenario("omni_plus", yaw="locked"))
    world.tell(world.station.set_message_interval(1, MessageId.ESC_TELEMETRY_1_TO_4, 10.0))
    world.guided()
    world.run(2.0, {1: NORTH})
    world.clear()
    return world


def in_world(fault: Fault) -> FaultModel:
    unit = fault.unit.name.lower()
    tree = {"vehicle": 1, "unit": unit, "type": fault.type, "applied_by": "world"}
    tree |= {"instances": fault.instances, "axes": fault.axes, "size": fault.size}
    return FaultModel.model_validate(tree)


def place(world: InWorld) -> tuple[float, ...]:
    truth = world.truth()
    return truth.north_m, truth.east_m, truth.north_mps, truth.east_mps


def told(world: InWorld) -> tuple[float, ...]:
    reported = world.reported()
    return *reported.position_m[:2], *reported.velocity_mps[:2]


@pytest.mark.parametrize("fault", CAN, ids=lambda f: f"{f.unit.name} {f.type}")
def test_the_effect_is_as_if_the_vehicle_did_it_and_ends(fault: Fault) -> None:
    """A vehicle breaks its next outputs, the world those in force: a frame later is the same."""
    by_vehicle, by_world, sound = driving(), driving(), driving()
    by_vehicle.inject(to_injection(fault))
    frame_s = 0.02 if fault.unit is Unit.MOTOR else 0.0
    by_world.run(frame_s, {1: SOUTH})
    by_world.simulation.obey(Break(in_world(fault)))
    by_world.run(3.3 - frame_s, {1: SOUTH})
    for world in (by_vehicle, sound):
        world.run(3.3, {1: SOUTH})
    assert place(by_world) == pytest.approx(place(by_vehicle), abs=0.03)
    assert told(by_world) == pytest.approx(told(by_vehicle), abs=0.06)
    gap = [a - b for a, b in zip(told(by_world), place(by_world), strict=True)]
    astray = [a - b for a, b in zip(place(by_world), place(sound), strict=True)]
    assert max(map(abs, gap if fault.unit is Unit.GPS else astray)) > 0.25

    by_world.simulation.obey(Mend(in_world(fault)))
    by_world.run(6.0, {1: REST})
    by_world.clear()
    by_world.run(5.0, {1: (0.3, 0.4, 0.0)})
    assert place(by_world)[2:] == pytest.approx((0.3, 0.4), abs=0.06)
    assert told(by_world)[:2] == pytest.approx(place(by_world)[:2], abs=0.08)


@pytest.mark.parametrize("fault", CAN, ids=lambda f: f"{f.unit.name} {f.type}")
def test_nothing_that_the_vehicle_reports_of_itself_tells(fault: Fault) -> None:
    world = driving()
    world.simulation.obey(Break(in_world(fault)))
    world.run(3.3, {1: NORTH})
    assert world.sent(StatusText) == []
    assert {s.present & ~s.health for s in world.sent(SysStatus)} == {0}
    forward = [s.pwm_us[0] for s in world.sent(ServoOutputs)]
    assert all(pwm > 1500 for pwm in forward) or fault.unit is Unit.GPS
    assert world.sent(EscTelemetry)[-1].escs[0].rpm > 0


def test_a_fault_hits_one_vehicle_alone() -> None:
    tree = scenario("omni_plus", yaw="locked").model_dump()
    tree["fleet"] = [
        tree["fleet"][0],
        tree["fleet"][0] | {"name": "two", "sysid": 2, "start": {"north_m": 5.0, "east_m": 0.0}},
    ]
    world = InWorld(type(scenario()).model_validate(tree))
    world.guided()
    world.simulation.obey(Break(in_world(EXAMPLES[WORLD_KINDS[0]])))
    world.run(4.0, {1: NORTH, 2: NORTH})
    assert world.truth(1).north_mps == 0.0
    assert world.truth(2).north_mps == pytest.approx(0.5, abs=0.06)


def test_motors_and_gps_at_once_and_one_is_cleared() -> None:
    tampering = Tampering(OMNI_PLUS)
    tampering.inject(to_injection(Fault(Unit.MOTOR, CAN[0].type, (3,))), 0.0)
    offset = Fault(Unit.GPS, EXAMPLES[WORLD_KINDS[-4]].type, size=(1.0, 2.0, 3.0))
    tampering.inject(to_injection(offset), 0.0)
    assert tampering.outputs((1600,) * 16, 0.1) == (1600, 1600, 0, *[1600] * 13)
    zero = (0.0, 0.0, 0.0)
    state = PhysicsState(0.1, (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), zero, zero, (0.7, 0.8, 0.9))
    assert tampering.told(state).position_m == (1.0, 2.0, 3.0)
    assert tampering.told(state).gyro_radps == state.gyro_radps
    assert tampering.told(state).accel_body_mps2 == state.accel_body_mps2
    assert tampering.told(state).attitude_rad == state.attitude_rad
    tampering.inject(to_clearing(Unit.GPS), 0.2)
    assert tampering.told(state) == state
    assert tampering.outputs((1600,) * 16, 0.2)[2] == 0


@pytest.mark.parametrize("name", AIRFRAMES)
def test_without_a_fault_nothing_is_changed(name: str) -> None:
    """32 channels, too: what is no motor of ours passes."""
    tampering = Tampering(AIRFRAMES[name])
    pwm = tuple(range(1100, 1132))
    assert tampering.outputs(pwm, 0.0) == pwm
    state = PhysicsState(0.1, *[(0.1, 0.2, 0.3)] * 5)
    assert tampering.told(state) is state


def test_what_cannot_be_put_in_effect_changes_nothing() -> None:
    tampering = Tampering(OMNI_PLUS)
    fifth = Injection((), ((int(Unit.MOTOR), int(FailureType.OFF), 5),))
    with pytest.raises(ValueError, match="can't put"):
        tampering.inject(fifth, 0.0)
    assert tampering.outputs((1600,) * 16, 0.0) == (1600,) * 16


def test_every_motor_fault_is_in_the_worlds_power() -> None:
    assert {k for u, k in WORLD_KINDS if u is Unit.MOTOR} == {
        k for u, k in EXAMPLES if u is Unit.MOTOR
    }
