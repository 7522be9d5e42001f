"""Fleet files and connection strings: what is shipped loads, what is wrong is said in one line."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from base_station.autopilots import adapter
from hil.connection import parse_connection
from hil.errors import InputError
from hil.scenario import StationView, load_station_view

FLEETS = Path(__file__).parents[2] / "fleets"
GOOD = ("udpin:0.0.0.0:14550", "udpout:10.0.0.7:14550", "tcp:rover.local:5760")
Edit = Callable[[dict[str, Any]], object]


@pytest.mark.parametrize("path", sorted(FLEETS.glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_fleets_load_and_their_autopilots_are_known(path: Path) -> None:
    view = load_station_view(path)
    assert view.safety is not None
    for member in view.fleet:
        adapter(member.autopilot, member.frame)


def test_three_rovers_share_one_radio() -> None:
    view = load_station_view(FLEETS / "three_rovers.yaml")
    assert [m.sysid for m in view.first_on_each_link] == [1]
    assert view.connection_of(view.fleet[2]).bytes_per_s == 5760.0


@pytest.mark.parametrize("text", [*GOOD, "serial:/dev/ttyUSB0,57600"])
def test_connections_round_trip(text: str) -> None:
    assert str(parse_connection(text)) == text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("14550", "must be udpin:HOST:PORT"),
        ("udp:127.0.0.1:14550", "must be udpin:HOST:PORT"),
        ("udpin:14550", "names no host"),
        ("udpin:127.0.0.1:70000", "port '70000' must be 1 to 65535"),
        ("serial:/dev/ttyUSB0", "names no host|baud rate"),
        ("serial:/dev/ttyUSB0,57601", "baud rate 57601 is none of"),
    ],
)
def test_bad_connections(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        parse_connection(text)


@pytest.mark.parametrize("text", ["udpin:127.0.0.1:1", "tcp:localhost:5760", "udpout:127.1.2.3:9"])
def test_what_is_on_this_machine_is_simulated(text: str) -> None:
    assert parse_connection(text).is_on_this_machine


@pytest.mark.parametrize("text", [*GOOD, "serial:/dev/ttyUSB0,57600"])
def test_all_else_may_be_real(text: str) -> None:
    assert not parse_connection(text).is_on_this_machine


BAD: dict[str, tuple[Edit, str]] = {
    "no word on contact": (lambda t: t["safety"].clear(), "safety.allow_contact: .* add it"),
    "sysid twice": (lambda t: t["fleet"][1].update(sysid=1), "used more than once"),
    "connection": (
        lambda t: t["fleet"][0].update(connection="com3"),
        "fleet.0.connection = 'com3'",
    ),
    "goal outside": (lambda t: t["fleet"][0]["goal"].update(north_m=99.0), "outside the arena"),
    "station is a vehicle": (lambda t: t.update(station_sysid=2), "is also a vehicle's"),
    "unknown key": (lambda t: t.update(geofence=1), "geofence"),
}


@pytest.mark.parametrize(("edit", "words"), BAD.values(), ids=BAD.keys())
def test_bad_fleet_files_are_refused_in_one_line(edit: Edit, words: str, tmp_path: Path) -> None:
    tree = yaml.safe_load((FLEETS / "three_rovers.yaml").read_text())
    edit(tree)
    path = tmp_path / "fleet.yaml"
    path.write_text(yaml.safe_dump(tree))
    with pytest.raises(InputError, match=words) as error:
        load_station_view(path)
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_a_view_says_how_a_vehicle_is_spoken_to_exactly_once(rescue_view: StationView) -> None:
    tree = rescue_view.model_dump()
    tree["fleet"][0]["connection"] = "udpin:127.0.0.1:14550"
    with pytest.raises(ValueError, match="exactly one of connection and mavlink_port"):
        StationView.model_validate(tree)
