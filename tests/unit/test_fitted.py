"""What `hil identify` found is what the twin has, what orders are late by, and what is forgiven."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from base_station.autopilots import adapter
from base_station.fitted import SLEW, fleet_model, latency_s, residual_m
from base_station.identify import NoseFirst, response_of
from base_station.identify.responses import on_grid
from base_station.twin import FleetModel
from hil.airframe import OMNI_PLUS, SKID_STEER
from hil.errors import InputError
from hil.scenario import load_scenario, load_station_view, station_view
from tests.conftest import SCENARIOS

FLEET = """
origin: {lat_deg: 47.0, lon_deg: 8.0, alt_m: 400.0}
arena: {north_min_m: -20, north_max_m: 20, east_min_m: -20, east_max_m: 20}
safety: {allow_contact: false}
fleet:
  - {name: one, sysid: 1, connection: "udpin:127.0.0.1:14550", airframe: skid_steer,
     autopilot: ardupilot, goal: {north_m: 1, east_m: 0}}
  - {name: two, sysid: 2, connection: "udpin:127.0.0.1:14560", airframe: omni_plus,
     autopilot: testbed, goal: {north_m: 0, east_m: 3}}
"""


def fit(model: str, parameters: list[float]) -> dict[str, object]:
    figures = dict.fromkeys(("time_constant_s", "speed_gain", "nominal_residual_m"), 1.0)
    found = {"model": model, "parameters": parameters, "latency_s": 0.25, "residual_m": 0.04}
    return {**figures, **found, "residual_mps": 0.05, "link_s": 0.1}


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    path = tmp_path / "fleet.yaml"
    path.write_text(FLEET)
    return path


def found(path: Path, sysid: int = 1) -> None:
    stall = SKID_STEER.axis_stall_force_n("x") / SKID_STEER.mass_kg
    axes = {"x": fit("heading_first", [1.2 * stall, 0.7, 0.25])}
    tree = {"identified": {"one": {"sysid": sysid, "axes": axes}}}
    path.with_suffix(".identified.yaml").write_text(yaml.safe_dump(tree))


def test_without_a_fit_the_twin_is_that_of_the_data_sheet(fleet: Path) -> None:
    view = load_station_view(fleet)
    plain, fitted = FleetModel.from_view(view), fleet_model(view)
    for mine, theirs in zip(fitted.nominal, plain.nominal, strict=True):
        assert np.array_equal(mine, theirs)
    assert [latency_s(m) for m in view.fleet] == [0.1, 0.0]
    assert residual_m(view).tolist() == [0.0, 0.0]


def test_with_one_it_is_what_was_found(fleet: Path) -> None:
    found(fleet)
    view = load_station_view(fleet)
    plain, fitted = FleetModel.from_view(view), fleet_model(view)
    ratio = fitted.nominal.stall_force_n / np.maximum(plain.nominal.stall_force_n, 1e-9)
    assert ratio[0, 0, :2] == pytest.approx(1.2)
    assert ratio[0, 1] == pytest.approx(1.0)
    assert fitted.vehicles.helm[0, SLEW] == 0.7
    assert [latency_s(m) for m in view.fleet] == pytest.approx([0.15, 0.0])  # the link's is not its
    assert residual_m(view).tolist() == [0.04, 0.0]


def test_a_fit_of_another_vehicle_is_refused(fleet: Path) -> None:
    found(fleet, sysid=7)
    with pytest.raises(InputError, match=r"identified\.one\.sysid = 7.*identify again"):
        load_station_view(fleet)


def test_a_heading_first_vehicle_is_identified_by_the_equations_of_its_twin() -> None:
    """Steady speed is the set-point, and the throttle slews: v(t) = F/m t^2/2 at first."""
    ardupilot = adapter("ardupilot", SKID_STEER)
    response = response_of(ardupilot, SKID_STEER, "x")
    assert isinstance(response, NoseFirst)
    stall, slew, _ = (float(x) for x in response.start)
    _, setpoint = on_grid(np.array([0.0, 12.0]), np.array([0.8, 0.8]))
    speeds = response.speeds(response.start, setpoint)
    assert speeds[-1] == pytest.approx(0.8, abs=0.02)
    rolls_s = 0.06 * 9.80665 / stall / slew
    assert speeds[20] == pytest.approx(stall * slew * (0.21 - rolls_s) ** 2 / 2.0, rel=0.3)


def test_what_lies_beside_a_scenario_is_what_its_station_is_told(tmp_path: Path) -> None:
    path = tmp_path / "scenario.yaml"
    path.write_text((SCENARIOS / "rescue.yaml").read_text())
    stall = OMNI_PLUS.axis_stall_force_n("x") / OMNI_PLUS.mass_kg
    axes = {"x": fit("integrating", [1.2 * stall, 0.5, 0.05, 0.25])}
    found = {"identified": {"rover_2": {"sysid": 2, "axes": axes}}}
    path.with_suffix(".identified.yaml").write_text(yaml.safe_dump(found))
    view = station_view(load_scenario(path), 14550, 1)
    fitted, plain = fleet_model(view), FleetModel.from_view(view)
    ratio = fitted.nominal.stall_force_n[0] / plain.nominal.stall_force_n[0]
    driven = [i - 1 for i in OMNI_PLUS.axis_motors("x")]
    assert ratio[1, driven] == pytest.approx(1.2)
    assert ratio[0] == pytest.approx(1.0)
    found["identified"]["rover_2"]["sysid"] = 3
    path.with_suffix(".identified.yaml").write_text(yaml.safe_dump(found))
    with pytest.raises(InputError, match=r"identified\.rover_2\.sysid = 3.*identify again"):
        load_scenario(path)
