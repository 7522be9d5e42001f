"""A radio that is gone for a while: the fleet stands meanwhile, and the mission goes on after."""

import json

import numpy as np
import pytest

from hil.scenario import load_scenario
from tests.conftest import SCENARIOS
from tests.scenarios.bench import run_until_ended, scripted, start

DARK_S = 8.0


@pytest.mark.parametrize("from_s", [6.0, 25.0], ids=["probe", "experiment"])
@pytest.mark.parametrize("whose", ["radio", "fleet.1.radio", "fleet.2.radio"])
def test_a_blackout_is_got_over(whose: str, from_s: float) -> None:
    dark = [{"from_s": from_s, "until_s": from_s + DARK_S, "loss": 1.0}]
    scenario = load_scenario(SCENARIOS / "rescue.yaml", [f"{whose}={json.dumps(dark)}"])
    rig, heard, times = start(scenario, scripted(0.8))
    for time_s in times:
        if time_s >= from_s + DARK_S:
            break
    outputs = [seat.outputs for seat in rig._seats.values()]
    assert not np.any([[p for p in pwm if p not in (0, 1500)] for pwm in outputs])  # all stand
    run_until_ended(rig, times)
    links = heard.texts("link")
    assert any(text.startswith("no word from") for text in links)
    assert any(text.startswith("in touch again") for text in links)
    verdict = rig.node.station.desk.verdict
    assert verdict is not None
    assert verdict.hypothesis == "motor_y_off"
    assert not [a for a in heard.texts("anomaly") if not a.startswith("rover_2")]
