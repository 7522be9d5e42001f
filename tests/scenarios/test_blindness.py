"""Blind means blind: what the station sees does not depend on what it is not told."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from base_station.listeners import Silent
from base_station.records import Snapshot
from hil.bench.folders import blind_view
from hil.bench.injector import Breaker
from hil.bench.onsets import Onsets
from hil.bench.rig import Rig
from hil.mavlink import Decoder, LocalPosition
from hil.scenario import Scenario, load_scenario

SCENARIOS = Path(__file__).parents[2] / "scenarios"
RESCUE, STUCK = SCENARIOS / "rescue.yaml", SCENARIOS / "stuck_gps.yaml"


class Wiretap(Silent):
    """Every datagram on the station's links, and whether its experiment has begun."""

    def __init__(self) -> None:
        self.heard: list[tuple[int, int, bytes]] = []
        self.experimenting = False

    def datagram(self, index: int, time_us: int, datagram: bytes) -> None:
        if not self.experimenting:
            self.heard.append((index, time_us, datagram))

    def snapshot(self, snapshot: Snapshot) -> None:
        self.experimenting |= snapshot.phase not in ("connect", "arm", "probe")


def _listen(scenario: Scenario, until_s: float) -> Wiretap:
    tap = Wiretap()
    rig = Rig(scenario, blind_view(scenario), [tap])
    breaker = Breaker(scenario, lambda _: None, lambda _: None, rig.simulation.obey)
    onsets = Onsets(scenario)
    breaker.strike(onsets.at_start())

    def inject() -> None:
        for vehicle, link in zip(scenario.fleet, rig.injector_links, strict=True):
            for datagram in breaker.step(rig.time_s, vehicle.sysid, link.receive()):
                link.send(datagram)

    while not breaker.done:
        inject()
        rig.serve()
    for advance in rig.run():
        for record in advance.truth:
            breaker.strike(onsets.due(record))
        inject()
        if tap.experimenting or rig.time_s > until_s:
            return tap
    raise AssertionError("unreachable")


@pytest.mark.parametrize("seed", [0, 3])
def test_before_the_experiment_rescue_and_stuck_gps_look_the_same(seed: int) -> None:
    """With equal seeds the same messages at the same times, and positions that differ by less than
    a quarter of the GPS noise: what an undriven axis does to the friction of the other one.
    """
    overrides = [f"seed={seed}"]
    motor = _listen(load_scenario(RESCUE, overrides), until_s=19.0)
    gps = _listen(load_scenario(STUCK, overrides), until_s=19.0)
    assert len(motor.heard) > 1000
    assert len(motor.heard) == len(gps.heard)
    decoder, limit_m = Decoder(), load_scenario(RESCUE).sensors.gps_position_sigma_m / 4
    for (_, time_us, one), (_, other_time_us, other) in zip(motor.heard, gps.heard, strict=True):
        assert time_us == other_time_us
        (a,), (b,) = decoder.decode(one), decoder.decode(other)
        assert type(a.value) is type(b.value)
        if isinstance(a.value, LocalPosition) and isinstance(b.value, LocalPosition):
            assert a.value.position_m == pytest.approx(b.value.position_m, abs=limit_m)
            assert a.value.velocity_mps == pytest.approx(b.value.velocity_mps, abs=2 * limit_m)


def test_before_its_onset_a_fault_changes_no_byte() -> None:
    def late(fault: str) -> Scenario:
        return load_scenario(RESCUE, [f"faults=[{{vehicle: 2, {fault}, onset: {{at_s: 12.0}}}}]"])

    motor = _listen(late("unit: motor, type: 'off', instances: [1, 2, 3, 4]"), until_s=11.99)
    gps = _listen(late("unit: gps, type: stuck"), until_s=11.99)
    none = _listen(load_scenario(RESCUE, ["faults=[]"]), until_s=11.99)
    assert motor.heard == none.heard
    assert gps.heard == none.heard


@pytest.mark.parametrize("path", [RESCUE, STUCK])
def test_who_applies_a_fault_changes_no_byte(path: Path) -> None:
    by_vehicle = _listen(load_scenario(path), until_s=10.0)
    by_world = _listen(load_scenario(path, ["faults.0.applied_by=world"]), until_s=10.0)
    assert by_world.heard == by_vehicle.heard


def test_the_view_has_no_word_of_fault_truth_seed_or_name() -> None:
    def view(path: Path, seed: int) -> Mapping[str, Any]:
        return blind_view(load_scenario(path, [f"seed={seed}"])).model_dump()

    assert view(RESCUE, 5) == view(STUCK, 5)
    different = {k for k in view(RESCUE, 5) if view(RESCUE, 5)[k] != view(RESCUE, 6)[k]}
    assert different == {"station_seed"}
    assert view(RESCUE, 5)["station_seed"] != 5


def test_nothing_readable_on_the_stations_links_names_a_fault() -> None:
    heard = b"".join(d for _, _, d in _listen(load_scenario(STUCK), until_s=19.0).heard)
    for word in (b"SIM_", b"fault", b"stuck", b"inject", b"fail"):
        assert word not in heard
        assert word.upper() not in heard
