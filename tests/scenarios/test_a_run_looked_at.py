"""One real rescue, looked at in every way: recording, viewer, browser, report, replay."""

import io
import json
import math
import os
import re
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from base_station.execution import SETTLE_S
from base_station.recording.blueprint import TABS
from base_station.recording.reading import Recording
from base_station.recording.screenshot import headless
from hil.bench.console import Console
from hil.bench.lines import StationEvent
from hil.bench.replaying import replay_run
from hil.bench.report.write import write_report
from hil.bench.run import RunOptions, run
from hil.bench.viewers import Viewer, serve_web
from hil.cli import main
from hil.frames import wgs84_to_ned
from hil.scenario import Scenario, load_scenario
from tests.conftest import SCENARIOS
from tests.drawing import needs_browser, needs_vulkan
from tests.recorder_reading import entities, rows, temporal
from tests.scenarios.chromium import browser

REPORTED_WITHIN_M = 0.25  # of the truth: noise, filter and latency of a sound vehicle
WEB_WITHIN_S = 60.0


@pytest.fixture(scope="module")
def rescued() -> Scenario:
    return load_scenario(SCENARIOS / "rescue.yaml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, rescued: Scenario) -> Path:
    out = tmp_path_factory.mktemp("run") / "rescue"
    assert run(rescued, RunOptions(out=out, in_memory=True)) == 0
    return out


@pytest.fixture(scope="module")
def rrd(folder: Path) -> Path:
    return folder / "mission.rrd"


@pytest.fixture(scope="module")
def recording(rrd: Path) -> Recording:
    return Recording(rrd)


def lines(path: Path) -> Iterator[dict[str, Any]]:
    with path.open() as file:
        yield from map(json.loads, file)


def truth(folder: Path, sysids: list[int]) -> tuple[np.ndarray, np.ndarray]:
    told = [t for t in lines(folder / "truth.jsonl") if t["type"] == "truth"]
    places = [[t["vehicles"][str(s)][:2] for s in sysids] for t in told]
    return np.array([t["time_s"] for t in told]), np.array(places)


def test_every_entity_of_the_run_is_there(rrd: Path, rescued: Scenario) -> None:
    expected = {"/fleet", "/trail", "/setpoint", "/focus", "/brief", "/map/fleet", "/map/goals"}
    expected |= {f"/{q}/{axis}" for q in ("residual", "alarm") for axis in ("north", "east")}
    expected |= {"/alarm/threshold", "/battery", "/satellites", "/speed", "/goal_distance"}
    expected |= {f"/belief/{q}" for q in ("log_likelihood", "behind_best")}
    expected |= {f"/belief/posterior/{h}" for h in ("none", "motor_y_off", "gps_east_stuck")}
    expected |= {f"/phase/{who}" for who in ("fleet", *(v.name for v in rescued.fleet))}
    expected |= {f"/motors/{v.name}" for v in rescued.fleet}
    for twin in ("none", "motor_y_off", "gps_east_stuck"):
        expected |= {f"/twins/{twin}/body", "/twins/trail"}
    expected |= {"/plan/alpha/motor_y_off", "/plan/alpha/gps_east_stuck", "/plan/beta"}
    expected |= {"/plane/arena", "/plane/goals", "/map/arena"}
    expected |= {f"/truth/{part}" for part in ("fleet", "trail", "contacts", "faults")}
    found = entities(rrd)
    assert expected <= found
    for kind in ("alpha", "beta"):
        assert any(e.startswith(f"/learning/{kind}/") for e in found)
        assert any(e.startswith(f"/curves/accepted/{kind}/") for e in found)


def test_the_truth_in_the_recording_is_the_truth_of_the_log(
    folder: Path, recording: Recording, rescued: Scenario
) -> None:
    times_s, places_m = truth(folder, [v.sysid for v in rescued.fleet])
    recorded_s, recorded_m = recording.places("/truth/fleet")
    assert recorded_s == pytest.approx(times_s, abs=1e-6)
    assert recorded_m == pytest.approx(places_m, abs=1e-5)


def test_reports_are_near_the_truth_at_the_same_time(
    folder: Path, recording: Recording, rescued: Scenario
) -> None:
    times_s, places_m = truth(folder, [v.sysid for v in rescued.fleet])
    reported_s, reported_m = recording.places("/fleet")
    then = [
        np.interp(reported_s, times_s, places_m[:, k, axis])
        for k in range(len(rescued.fleet))
        for axis in (0, 1)
    ]
    apart_m = reported_m.reshape(len(reported_s), -1).T - np.array(then)
    assert np.abs(apart_m).max() < REPORTED_WITHIN_M


def test_contacts_are_where_and_when_they_were(folder: Path, rrd: Path) -> None:
    told = [t for t in lines(folder / "truth.jsonl") if t["type"] == "contact"]
    found = temporal(rrd, "/truth/contacts", "Points3D:positions")
    assert [t for t, _ in found] == pytest.approx([c["time_s"] for c in told], abs=1e-3)
    for contact, (_, [(east, north, _)]) in zip(told, found, strict=True):
        assert (north, east) == pytest.approx(contact["point_m"], abs=1e-3)
    texts = [text for _, [text] in temporal(rrd, "/truth/contact_log", "TextLog:text")]
    assert all(f"{c['peak_impulse_ns']:.2f} N s" in t for c, t in zip(told, texts, strict=True))


def test_every_event_is_in_the_log_at_its_time(folder: Path, rrd: Path) -> None:
    told = list(lines(folder / "station-events.jsonl"))
    for kind in {event["kind"] for event in told}:
        found = temporal(rrd, f"/events/{kind}", "TextLog:text")
        expected = [(e["time_s"], f"{kind}: {e['text']}") for e in told if e["kind"] == kind]
        assert sorted(text for _, [text] in found) == sorted(text for _, text in expected)
        assert sorted(t for t, _ in found) == pytest.approx(sorted(t for t, _ in expected))


def test_phases_change_when_the_events_say_so(folder: Path, rrd: Path) -> None:
    told = [e["text"] for e in lines(folder / "events.jsonl") if e["kind"] == "phase"]
    found = [state for _, [state] in temporal(rrd, "/phase/fleet", "StateChange:state")]
    assert found == told[-len(found) :]


def test_every_experiment_is_drawn_before_it_is_driven(folder: Path, rrd: Path) -> None:
    """The suspect alone, and then contact; a plan is on the plane before the first arrow is."""
    begun_s = [e["time_s"] for e in lines(folder / "events.jsonl") if e["text"] == "experiment"]
    plans = [e for e in entities(rrd) if e.startswith("/plan/alpha/")]
    drawn_s = {t for e in plans for t, ways in temporal(rrd, e, "LineStrips3D:strips") if ways}
    arrows_s = [t for t, arrows in temporal(rrd, "/setpoint", "Arrows3D:vectors") if arrows]
    assert len(drawn_s) == len(begun_s) == 2
    for planned_s, start_s in zip(sorted(drawn_s), begun_s, strict=True):
        assert planned_s == pytest.approx(start_s, abs=0.05)
        assert planned_s < next(t for t in arrows_s if t >= planned_s)


def test_plan_beta_is_there_before_it_is_driven(folder: Path, rrd: Path) -> None:
    (planned_s, [*ways]) = temporal(rrd, "/plan/beta", "LineStrips3D:strips")[0]
    begun_s = [e["time_s"] for e in lines(folder / "events.jsonl") if e["text"] == "mission"]
    assert planned_s <= begun_s[0]
    assert len(ways) == 3


def test_learning_is_a_curve_on_every_timeline(rrd: Path, recording: Recording) -> None:
    for path in recording.entities("/learning/"):
        for timeline in ("sim_time", "wall_time", "training_steps"):
            grown = temporal(rrd, path, "Scalars:scalars", timeline)
            times = {time for time, _ in grown}
            assert len(times) > 3
            assert timeline != "training_steps" or len(times) == len(grown)


def test_quantities_have_their_units(recording: Recording, rescued: Scenario) -> None:
    times_s, places_m = recording.places("/fleet")
    goals_m = np.array([(v.goal.north_m, v.goal.east_m) for v in rescued.fleet])
    distance = recording.scalars("/goal_distance")
    then = np.isin(np.round(times_s, 3), np.round(distance.times, 3))
    told_m = np.linalg.norm(places_m[then] - goals_m, axis=2)
    assert distance.values[-len(told_m) :] == pytest.approx(told_m, abs=2e-3)
    posterior = np.nan_to_num(recording.family("/belief/posterior").values)
    assert (posterior.sum(axis=1) <= 1.0 + 1e-6).all()
    assert (posterior.sum(axis=1) >= 0.95).all()  # lines begin at 1 %
    for vehicle in rescued.fleet:
        outputs = recording.scalars(f"/motors/{vehicle.name}").values
        assert outputs.shape[1] == len(vehicle.frame.motors)
        assert np.abs(outputs).max() <= 1.0
    assert 0.3 < np.nanmax(recording.scalars("/speed").values) < 2.0  # m/s
    assert (recording.scalars("/battery").values > 50.0).all()  # %


def test_the_map_shows_the_same_places(rrd: Path, recording: Recording, rescued: Scenario) -> None:
    times_s, places_m = recording.places("/fleet")
    origin = rescued.origin.origin()
    for time_s, degrees in temporal(rrd, "/map/fleet", "GeoPoints:positions")[::10]:
        row = int(np.abs(times_s - time_s).argmin())
        there = [wgs84_to_ned(lat, lon, origin) for lat, lon in degrees]
        assert np.array(there) == pytest.approx(places_m[row], abs=0.01)


def test_the_document_has_the_verdict_and_the_versions(rrd: Path) -> None:
    *_, (_, [page]) = rows(rrd, "/brief", "TextDocument:text")
    assert "rover_2: motor_y_off" in page
    assert "rerun-sdk 0.41" in page


@needs_vulkan
def test_no_view_warns_at_any_moment_of_the_run(rrd: Path, tmp_path: Path) -> None:
    with headless(rrd) as viewer:
        for time_s in (21.3, 40.0):
            for tab in TABS:
                viewer.shoot(time_s, tmp_path / "tab.png", tab)
                assert viewer.warnings() == [], (tab, time_s)


@needs_vulkan
def test_a_picture_by_command(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.png"
    assert main(["shot", str(folder), "--at", "23.7", "--view", "Close up", "-o", str(out)]) == 0
    assert _colors(out.read_bytes()) > 100


def test_replaying_the_run_gives_the_same_decisions(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert replay_run([folder], None) == 0
    assert "no decisions would differ" in capsys.readouterr().out


def test_the_report_needs_nothing_else(folder: Path) -> None:
    page = write_report(folder)
    html = page.read_text()
    assert "<script" not in html
    assert re.findall(r'(?:src|href)="(?!data:)', html) == []
    pictures = {p.name for p in (folder / "report").iterdir()}
    names = ("trajectories", "residuals", "posterior", "learning", "timings")
    assert pictures == {f"{name}.png" for name in names}


@needs_browser
def test_the_report_opens_from_disk_in_a_browser(folder: Path, tmp_path: Path) -> None:
    page = write_report(folder)
    with browser(str(tmp_path)) as tab:
        tab.open(page.as_uri())
        assert tab.errors == []
        assert [url for url in tab.requested if not url.startswith(("file:", "data:"))] == []
        assert tab.evaluate("[...document.images].every(i => i.naturalWidth > 900)")
        assert (
            tab.evaluate("document.querySelector('.verdict').innerText") == "rover_2: motor_y_off"
        )
        assert tab.evaluate("document.body.scrollWidth <= window.innerWidth")


@needs_browser
def test_the_web_viewer_shows_the_run_in_a_browser(rrd: Path, tmp_path: Path) -> None:
    with serve_web(rrd) as web, browser(str(tmp_path)) as tab:
        tab.open(f"{web.url}&renderer=webgl")
        deadline_s = time.monotonic() + WEB_WITHIN_S
        while (colors := _colors(tab.screenshot())) < 500 and time.monotonic() < deadline_s:
            time.sleep(0.5)
        assert colors >= 500
        assert tab.errors == []


def test_a_viewer_that_never_reads_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    healthy = load_scenario(SCENARIOS / "healthy.yaml")
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen()
        viewer = Viewer(f"127.0.0.1:{deaf.getsockname()[1]}")
        monkeypatch.setattr("hil.bench.run.live_viewer", lambda *_: viewer)
        started_s = time.monotonic()
        assert run(healthy, RunOptions(out=tmp_path / "run", in_memory=True, viewer=True)) == 0
        assert time.monotonic() - started_s < 60.0
    assert Recording(tmp_path / "run" / "mission.rrd").places("/fleet")[0].size > 300


class Killer(Console):
    """Kills the viewer, the hard way, as soon as a phase begins."""

    def __init__(self, phase: str, pid: int) -> None:
        super().__init__()
        self._phase, self._pid = phase, pid
        self.killed_s = math.nan

    def event(self, event: StationEvent) -> None:
        super().event(event)
        if event.kind == "phase" and event.text == self._phase:
            os.kill(self._pid, signal.SIGKILL)
            self.killed_s = event.time_s


@needs_vulkan
def test_a_viewer_killed_in_the_midst_of_a_run_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    healthy = load_scenario(SCENARIOS / "healthy.yaml")
    with headless() as viewer:
        monkeypatch.setattr("hil.bench.run.live_viewer", lambda *_: Viewer(viewer.address))
        console = Killer("probe", viewer.pid)
        run(healthy, RunOptions(out=tmp_path / "run", viewer=True), console)
    times_s, _ = Recording(tmp_path / "run" / "mission.rrd").places("/fleet")
    assert times_s[-1] > console.killed_s + 20.0
    assert np.diff(times_s) == pytest.approx(0.1)  # no tick is late or missing
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["ended"] == "completed"
    assert {goal["declared"] for goal in result["goals"].values()} == {"reached"}
    probed_s = next(p["sim_s"] for p in result["phases"] if p["phase"] == "probe")
    pulses_s = 4 * len(healthy.fleet) * (healthy.limits.probe_pulse_s + SETTLE_S)
    assert probed_s == pytest.approx(pulses_s, abs=0.3)


def _colors(png: bytes) -> int:
    with Image.open(io.BytesIO(png)) as picture:
        return len(picture.convert("RGB").getcolors(1 << 24))
