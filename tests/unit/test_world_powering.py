"""A foreign firmware's motors get power when it has once been silent; ours have it at once."""

from hil.scenario import Scenario
from hil.world.powering import Powering


def test_a_booting_firmware_drives_nobody_off(rescue: Scenario) -> None:
    foreign = rescue.fleet[0].model_copy(update={"autopilot": "somebodys"})
    powering = Powering((foreign, rescue.fleet[1]))
    booting, ours = (1000, 0, 1000, 0, 0), (1600, 1500, 1500, 1500, 0)
    assert powering.outputs({1: booting, 2: ours}) == {1: (0,) * 5, 2: ours}
    assert powering.outputs({2: ours}) == {2: ours}
    assert powering.outputs({1: (1500,) * 5, 2: ours})[1] == (0,) * 5
    disarmed = (0, 0, 0, 0, 1500)
    assert powering.outputs({1: disarmed, 2: ours})[1] == disarmed
    assert powering.outputs({1: booting, 2: ours})[1] == booting
