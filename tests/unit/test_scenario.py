"""Scenario files: what is refused, in which words, and what comes back unchanged."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from hil.cli import main
from hil.errors import InputError
from hil.scenario import Scenario, load_scenario, load_station_view, station_view

SCENARIOS = sorted((Path(__file__).parents[2] / "scenarios").glob("*.yaml"))
RESCUE = Path(__file__).parents[2] / "scenarios" / "rescue.yaml"

BAD_FILES: dict[str, tuple[bytes | None, str]] = {
    "missing": (None, "cannot be read"),
    "empty": (b"", "is empty"),
    "broken": (b"a: [1, 2", "not valid YAML"),
    "binary": (b"\x89PNG\r\n\xff\xfe\x00", "not UTF-8"),
    "control characters": (b"a: \x00\x01", "not valid YAML"),
    "list": (b"- 1\n- 2\n", "is a list"),
    "scalar": (b"7", "is a single value"),
    "key twice": (b"name: a\nname: b\n", "given twice"),
    "alias": (b"a: &x 1\nb: *x\n", "aliases"),
    "deep": (b"[" * 5000, "nested too deeply"),
    "no such day": (b"name: 2020-13-45\n", "not valid YAML"),
    "endless number": (b"seed: " + b"9" * 5000, "not valid YAML"),
    "large": (b"#" * 1_000_001, "the limit is"),
    "python object": (b"a: !!python/object/apply:os.getcwd []", "not valid YAML"),
}

Edit = Callable[[dict[str, Any]], object]


def fence(north_max_m: float) -> dict[str, float]:
    return {"north_min_m": -1, "north_max_m": north_max_m, "east_min_m": -4, "east_max_m": 4.5}


BAD_VALUES: dict[str, tuple[Edit, str]] = {
    "unknown key": (lambda t: t.update(colour="red"), "colour"),
    "sysid twice": (lambda t: t["fleet"][1].update(sysid=1), "used more than once"),
    "name twice": (lambda t: t["fleet"][1].update(name="rover_1"), "used more than once"),
    "sysid negative": (lambda t: t["fleet"][0].update(sysid=-1), "fleet.0.sysid"),
    "sysid NaN": (lambda t: t["fleet"][0].update(sysid=float("nan")), "fleet.0.sysid"),
    "sysid of the station": (lambda t: t.update(links={"station_sysid": 2}), "station_sysid"),
    "one sysid for both": (
        lambda t: t.update(links={"station_sysid": 251}),
        "must differ",
    ),
    "goal outside": (lambda t: t["fleet"][0]["goal"].update(north_m=99.0), "outside the arena"),
    "goal infinite": (lambda t: t["fleet"][0]["goal"].update(north_m=float("inf")), "goal.north_m"),
    "start in a wall": (lambda t: t["fleet"][0]["start"].update(east_m=-4.9), "outside the arena"),
    "starts overlap": (lambda t: t["fleet"][0]["start"].update(east_m=-0.5), "inside each other"),
    "no fleet": (lambda t: t.update(fleet=[]), "fleet"),
    "goal beyond the horizon": (
        lambda t: t["fleet"][0]["goal"].update(north_m=1e308),
        "fleet.0.goal.north_m = 1e+308",
    ),
    "ports run out": (
        lambda t: t.update(links={"mavlink_port_base": 65_000}),
        "3 vehicles need ports up to 65020; the limit is 65000",
    ),
    "empty arena": (lambda t: t["arena"].update(north_max_m=-9.0), "arena is empty"),
    "fence beyond the walls": (lambda t: t.update(geofence=fence(9.0)), "outside the arena"),
    "goal outside the fence": (lambda t: t.update(geofence=fence(0.5)), "outside the geofence"),
    "start in an obstacle": (
        lambda t: t.update(obstacles=[{"at": dict(t["fleet"][0]["start"]), "radius_m": 0.5}]),
        "from obstacles.0",
    ),
    "obstacle without a radius": (
        lambda t: t.update(obstacles=[{"at": dict(t["fleet"][0]["start"]), "radius_m": 0.0}]),
        "obstacles.0.radius_m",
    ),
    "a twin that answers too late": (
        lambda t: t.update(uncertainty={"latency_max_s": 0.2}),
        "uncertainty.latency_max_s",
    ),
    "fence without an inside": (lambda t: t.update(geofence=fence(-9.0)), "geofence is empty"),
    "fault of a stranger": (lambda t: t["faults"][0].update(vehicle=9), "not in the fleet"),
    "fault of motor 5": (lambda t: t["faults"][0].update(instances=[5]), "the highest is 4"),
    "fault nobody can make": (lambda t: t["faults"][0].update(type="bias"), "no injector"),
    "two onsets": (
        lambda t: t["faults"][0].update(onset={"at_s": 1.0, "when": "rover_2.north_m > 1"}),
        "exactly one",
    ),
    "onset of a stranger": (
        lambda t: t["faults"][0].update(onset={"when": "rover_9.north_m > 1"}),
        "not in the fleet",
    ),
    "rates that do not divide": (lambda t: t.update(clock={"physics_hz": 130}), "must divide"),
    "expects a stranger": (lambda t: t.update(expect={"sysid": 9}), "expect names vehicle 9"),
    "off is false in YAML": (lambda t: t["faults"][0].update(type=False), "faults.0.type"),
}

BAD_OVERRIDES = {
    "no value": ("seed", "must be key.path=value"),
    "no key": ("=3", "must be key.path=value"),
    "no such key": ("planning.colour=red", "planning.colour"),
    "index too high": ("fleet.7.sysid=3", "not an index"),
    "inside a value": ("yaw.x=3", "inside a plain value"),
    "not YAML": ("seed=[", "not valid YAML"),
    "no such day": ("seed=2020-13-45", "not valid YAML"),
    "endless number": (f"seed={'9' * 5000}", "999...: the value is not valid YAML"),
    "deep": (f"seed={'[' * 5000}", "not valid YAML"),
    "digit that is no number": ("fleet.\u00b2.sysid=3", "not an index"),
    "wrong kind": ("seed=many", "seed"),
}


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """The one line on stderr with which a command is refused."""
    assert main(argv) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("hil: ")
    assert captured.err.count("\n") == 1
    return captured.err


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_shipped_scenarios_pass_the_check(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(path)]) == 0
    assert load_scenario(path).name == path.stem
    assert path.stem in capsys.readouterr().out


@pytest.mark.parametrize(("raw", "words"), BAD_FILES.values(), ids=BAD_FILES.keys())
@pytest.mark.parametrize("command", ["check", "run"])
def test_bad_files(
    raw: bytes | None,
    words: str,
    command: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "bad.yaml"
    if raw is not None:
        path.write_bytes(raw)
    line = refused(capsys, command, str(path))
    assert words in line
    assert str(path) in line
    assert set(tmp_path.iterdir()) <= {path}


@pytest.mark.parametrize(("edit", "words"), BAD_VALUES.values(), ids=BAD_VALUES.keys())
def test_bad_values(
    edit: Edit, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tree = yaml.safe_load(RESCUE.read_text())
    edit(tree)
    path = tmp_path / "bad.yaml"
    path.write_text(yaml.safe_dump(tree))
    line = refused(capsys, "run", str(path), "--out", str(tmp_path / "out"))
    assert words in line
    assert str(path) in line
    assert set(tmp_path.iterdir()) == {path}


@pytest.mark.parametrize(("override", "words"), BAD_OVERRIDES.values(), ids=BAD_OVERRIDES.keys())
def test_bad_overrides(
    override: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert words in refused(capsys, "run", str(RESCUE), "--set", override, "--out", str(out))
    assert not out.exists()


@pytest.mark.parametrize(
    "option",
    [
        ("--speed", "-1"),
        ("--speed", "nan"),
        ("--speed", "1e-320"),
        ("--speed", "fast"),
        ("--seed", "x"),
        ("--seed", "9" * 5000),
        ("--colour",),
        ("--out", "x" * 300),
    ],
    ids=lambda option: " ".join(option)[:20],
)
def test_bad_options(option: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert option[0] in refused(capsys, "run", str(RESCUE), *option)


def test_what_the_station_has_no_twin_of_is_refused_before_anything_is_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    argv = ("run", str(RESCUE), "--set", "fleet.0.airframe=quad_x", "--out", str(out))
    assert "rover_1 is a quad_x" in refused(capsys, *argv)
    assert not out.exists()


@pytest.mark.parametrize("port", ["-1", "65530", "99999"])
def test_a_world_refuses_ports_there_are_not(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "port" in refused(capsys, "world", str(RESCUE), "--physics-port", port)


def test_overrides_reach_nested_values_and_lists() -> None:
    scenario = load_scenario(
        RESCUE, ["seed=7", "fleet.1.goal.north_m=2.5", "links.mavlink_port_base=15000"]
    )
    assert scenario.seed == 7
    assert scenario.fleet[1].goal.north_m == 2.5
    assert scenario.links.mavlink_port_base == 15000


def test_the_station_view_holds_no_truth(tmp_path: Path) -> None:
    scenario = load_scenario(RESCUE)
    view = station_view(scenario, 15000, 42)
    text = view.model_dump_json()
    for secret in ("rescue", "fault", "plant", "expect", "description", "start_m"):
        assert secret not in text
    assert '"seed"' not in text
    elsewhere = load_scenario(RESCUE, ["plant.motor_gain_sigma=0.29", "plant.rolling_sigma=0.0"])
    assert station_view(elsewhere, 15000, 42) == view
    path = tmp_path / "view.json"
    path.write_text(text)
    assert load_station_view(path) == view


def test_a_view_is_no_scenario(tmp_path: Path) -> None:
    path = tmp_path / "view.json"
    path.write_text(station_view(load_scenario(RESCUE), 15000, 42).model_dump_json())
    with pytest.raises(InputError):
        load_scenario(path)


def test_schema_names_every_key(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    shown = capsys.readouterr().out
    for key in Scenario.model_fields:
        assert f'"{key}"' in shown
