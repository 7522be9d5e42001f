"""What tests share: the shipped scenarios, and the view of the rescue."""

from pathlib import Path

import pytest

from hil.scenario import Scenario, StationView, load_scenario, station_view

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.fixture
def rescue() -> Scenario:
    return load_scenario(SCENARIOS / "rescue.yaml")


@pytest.fixture
def rescue_view(rescue: Scenario) -> StationView:
    return station_view(rescue, mavlink_port_base=14550, station_seed=1)
