"""`hil identify` recovers the parameters of our own vehicles, which the test knows."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from base_station.identify import FirstOrder, Integrating, Tried, fit_axis
from base_station.identify.responses import DT_S
from base_station.identify.session import Identification, VehicleFit
from base_station.identify.store import write_fits
from hil.airframe import OMNI_PLUS, Airframe
from hil.bench.rig import Rig
from hil.scenario import Scenario, load_scenario, station_view
from hil.world.plant import real_airframe

HEALTHY = Path(__file__).parents[2] / "scenarios" / "healthy.yaml"
DELAY_S = 0.04


def one_rover(seed: int, delay_s: float) -> Scenario:
    scenario = load_scenario(HEALTHY, [f"seed={seed}", f"radio.delay_s={delay_s}", "expect={}"])
    return scenario.model_copy(update={"fleet": scenario.fleet[:1]})


def identified(scenario: Scenario) -> VehicleFit:
    view = station_view(scenario, 14550, 1)
    identification = Identification(view)
    rig = Rig(scenario, view, [identification])
    rig.node.station = identification.station
    for _ in rig.run():
        if rig.node.finished:
            break
    assert identification.complete
    (fit,) = identification.fits()
    return fit


def truly(real: Airframe, sheet: Airframe, axis: str, speed_mps: float) -> tuple[float, float]:
    """Time constant (s) and speed gain of a rover whose motors and mass are known."""
    stall = real.axis_stall_force_n(axis) / real.mass_kg
    rolling = real.rolling_force_n / real.mass_kg
    known = Integrating(sheet, axis).derived(np.array([stall, rolling, 0.0, 0.0]), speed_mps)
    return known.time_constant_s, known.speed_gain


@pytest.fixture(scope="module")
def quick_and_slow() -> tuple[Scenario, VehicleFit, VehicleFit]:
    """One rover, found twice: over a radio without delay, and over one with."""
    scenario = one_rover(seed=3, delay_s=0.0)
    return scenario, identified(scenario), identified(one_rover(seed=3, delay_s=DELAY_S))


def test_gains_and_time_constants_within_five_percent(
    quick_and_slow: tuple[Scenario, VehicleFit, VehicleFit],
) -> None:
    scenario, *fits = quick_and_slow
    real = real_airframe(OMNI_PLUS, scenario.plant, scenario.seed, 1)
    for fit in fits:
        for axis, found in fit.axes.items():
            time_constant_s, gain = truly(real, OMNI_PLUS, axis, 0.8)
            assert found.derived.time_constant_s == pytest.approx(time_constant_s, rel=0.05)
            assert found.derived.speed_gain == pytest.approx(gain, rel=0.05)


def test_latency_within_ten_milliseconds(
    quick_and_slow: tuple[Scenario, VehicleFit, VehicleFit],
) -> None:
    """The station's own step is 0.05 s; the radio's delay counts up and down."""
    _, quick, slow = quick_and_slow
    for axis in ("x", "y"):
        assert quick.axes[axis].derived.latency_s == pytest.approx(0.05, abs=0.01)
        more_s = slow.axes[axis].derived.latency_s - quick.axes[axis].derived.latency_s
        assert more_s == pytest.approx(2.0 * DELAY_S, abs=0.01)
        of_link_s = slow.axes[axis].link_s - quick.axes[axis].link_s
        assert of_link_s == pytest.approx(2.0 * DELAY_S, abs=0.01)


def test_noise_within_fifteen_percent(
    quick_and_slow: tuple[Scenario, VehicleFit, VehicleFit],
) -> None:
    scenario, *fits = quick_and_slow
    for fit in fits:
        assert fit.noise is not None
        sensors = scenario.sensors
        assert fit.noise.gps_position_sigma_m == pytest.approx(
            sensors.gps_position_sigma_m, rel=0.15
        )
        assert fit.noise.gps_velocity_sigma_mps == pytest.approx(
            sensors.gps_velocity_sigma_mps, rel=0.15
        )


def test_the_fit_leaves_less_than_the_data_sheet_and_is_stored(
    quick_and_slow: tuple[Scenario, VehicleFit, VehicleFit], tmp_path: Path
) -> None:
    scenario, _, slow = quick_and_slow
    for axis in slow.axes.values():
        assert axis.residual_m < 0.7 * axis.nominal_residual_m
    path = tmp_path / "fleet.identified.yaml"
    write_fits(path, station_view(scenario, 14550, 1), [slow])
    stored = yaml.safe_load(path.read_text())["identified"]["rover_1"]
    assert stored["axes"]["x"]["time_constant_s"] == pytest.approx(
        slow.axes["x"].derived.time_constant_s, abs=1e-5
    )


def test_any_velocity_controller_seen_from_afar() -> None:
    """Gain, time constant and latency of a first-order answer with noise, in closed form."""
    rng = np.random.default_rng(1)
    setpoint = np.repeat(rng.uniform(-1.0, 1.0, 40), 10)
    sent_s = 0.1 * np.arange(len(setpoint))
    gain, tau_s, latency_s = 0.9, 0.7, 0.23
    fine = np.repeat(setpoint, 10)
    speed = np.zeros(len(fine))
    for k in range(1, len(fine)):
        speed[k] = speed[k - 1] + (gain * fine[k] - speed[k - 1]) * (1.0 - np.exp(-DT_S / tau_s))
    grid_s = DT_S * np.arange(len(fine))
    seen = np.interp(sent_s - latency_s, grid_s, speed, left=0.0)
    place = np.interp(sent_s - latency_s, grid_s, np.cumsum(speed) * DT_S, left=0.0)
    noisy = seen + 0.03 * rng.standard_normal(len(seen))
    tried = Tried(0, 0, 0.0, sent_s, setpoint, sent_s, place, noisy)
    found = fit_axis(tried, FirstOrder()).derived
    assert found.speed_gain == pytest.approx(gain, rel=0.02)
    assert found.time_constant_s == pytest.approx(tau_s, rel=0.03)
    assert found.latency_s == pytest.approx(latency_s, abs=0.01)


def test_too_little_to_fit_is_refused() -> None:
    short = np.zeros(10)
    with pytest.raises(ValueError, match="10 reports are too few"):
        fit_axis(Tried(0, 0, 0.0, short, short, short, short, short), FirstOrder())
