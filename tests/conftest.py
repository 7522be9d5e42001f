"""What tests share: the shipped scenarios, and the view of the rescue."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from hil.scenario import Scenario, StationView, load_scenario, station_view

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.fixture(autouse=True, scope="session")
def _no_saved_plans(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Plans that an earlier run of the tests has saved are not found."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def rescue() -> Scenario:
    return load_scenario(SCENARIOS / "rescue.yaml")


@pytest.fixture
def rescue_view(rescue: Scenario) -> StationView:
    return station_view(rescue, mavlink_port_base=14550, station_seed=1)
