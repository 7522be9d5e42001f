"""A foreign firmware has no motor power while one motor gets no pulses; ours is left alone."""

from hil.scenario import Scenario
from hil.world.powering import Powering


def test_a_disarmed_firmware_drives_nobody_off(rescue: Scenario) -> None:
    foreign = rescue.fleet[0].model_copy(update={"autopilot": "somebodys"})
    powering = Powering((foreign, rescue.fleet[1]))
    disarmed, ours = (1000, 0, 1500, 1500, 0), (1600, 0, 1500, 1500, 0)
    assert powering.outputs({1: disarmed, 2: ours}) == {1: (0,) * 5, 2: ours}
    assert powering.outputs({2: ours}) == {2: ours}
    armed = (1500, 1600, 1400, 1500, 0)  # channels beyond its motors may be silent
    assert powering.outputs({1: armed, 2: ours}) == {1: armed, 2: ours}
    assert powering.outputs({1: disarmed})[1] == (0,) * 5
