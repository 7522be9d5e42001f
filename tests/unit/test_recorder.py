"""The recorder: what the station tells is in the recording, with its values and times."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import recorder_fake_run as fake
import rerun as rr
from recorder_reading import Rows, entities, rows, temporal
from rerun.chunk import RrdReader

from base_station.recorder import Recorder
from base_station.recording.brief import ranked
from base_station.recording.merge import merge
from base_station.recording.scene import NOSE_AT, hypotheses
from base_station.recording.truth import TruthRecorder
from base_station.recording.twin_rows import LINE_TO
from base_station.records import Foreseen, Snapshot
from benchmarks import recorder as crowd
from hil.frames import wgs84_to_ned
from hil.scenario import Geofence

RESOLUTION = 1.0 / 512.0  # of what a vehicle's line shows, in its unit


def at(found: Rows, time_s: float) -> Any:
    """The row of a time."""
    [value] = [v for t, v in found if t == pytest.approx(time_s)]
    return value


@pytest.fixture(scope="module", autouse=True)
def _strict() -> Iterator[None]:
    rr.set_strict_mode(True)
    yield
    rr.set_strict_mode(False)


@pytest.fixture(scope="module")
def story() -> list[Snapshot]:
    return list(fake.snapshots())


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory, story: list[Snapshot]) -> Path:
    path = tmp_path_factory.mktemp("recording") / "station.rrd"
    recorder = Recorder(path, "demo", fake.view())
    fake.tell(recorder, story)
    recorder.close()
    assert recorder.failures == 0
    return path


def test_one_recording_and_three_timelines(recording: Path) -> None:
    reader = RrdReader(str(recording))
    assert [(r.application_id, r.recording_id) for r in reader.recordings()] == [("hil", "demo")]
    assert [b.application_id for b in reader.blueprints()] == ["hil"]
    timelines = {name for chunk in reader.stream().to_chunks() for name in chunk.timeline_names}
    assert timelines == {"sim_time", "wall_time", "training_steps"}


def test_nothing_of_the_truth_is_in_the_stations_part(recording: Path) -> None:
    assert not [entity for entity in entities(recording) if entity.startswith("/truth")]


def test_positions_are_east_north_up(recording: Path, story: list[Snapshot]) -> None:
    found = temporal(recording, "/fleet", "Cylinders3D:centers")
    assert [t for t, _ in found] == pytest.approx([s.time_s for s in story])
    told = [[(v.reported_m[1], v.reported_m[0], 0.0) for v in s.vehicles] for s in story]
    assert np.array([v for _, v in found]) == pytest.approx(np.array(told), abs=1e-6)
    [(_, radii)] = rows(recording, "/fleet", "Cylinders3D:radii")
    assert radii == pytest.approx([0.3] * 3)


def test_the_nose_points_where_the_vehicle_does(tmp_path: Path, story: list[Snapshot]) -> None:
    east = Snapshot(
        1.0,
        "mission",
        12.0,
        tuple(fake.turned(v, yaw_rad=np.pi / 2) for v in story[0].vehicles),
        (),
    )
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    recorder.snapshot(east)
    recorder.close()
    [(_, centres)] = temporal(tmp_path / "a.rrd", "/fleet", "Cylinders3D:centers")
    [(_, noses)] = temporal(tmp_path / "a.rrd", "/fleet", "Points3D:positions")
    off_m = np.array(noses[0]) - np.array(centres[0])
    assert off_m[:2] == pytest.approx([NOSE_AT * 0.3, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("entity", "every", "value"),
    [
        ("/residual/north", 1, lambda v: v.residual[0]),
        ("/residual/east", 1, lambda v: v.residual[1]),
        ("/alarm/north", 1, lambda v: v.cusum[0]),
        ("/alarm/east", 1, lambda v: v.cusum[1]),
        ("/speed", 2, lambda v: np.hypot(*v.velocity_mps)),
    ],
)
def test_series_have_a_value_per_vehicle(
    recording: Path, story: list[Snapshot], entity: str, every: int, value: object
) -> None:
    assert callable(value)
    found = temporal(recording, entity, "Scalars:scalars")
    assert [t for t, _ in found] == pytest.approx([s.time_s for s in story[::every]])
    told = [[value(v) for v in s.vehicles] for s in story[::every]]
    assert np.array([v for _, v in found]) == pytest.approx(np.array(told), abs=RESOLUTION / 2)
    [(_, names)] = rows(recording, entity, "SeriesLines:names")
    assert names == ["rover_1", "rover_2", "rover_3"]


def test_slow_things_come_once_a_second(recording: Path, story: list[Snapshot]) -> None:
    battery = temporal(recording, "/battery", "Scalars:scalars")
    assert len(battery) == fake.END_S + 1
    time_s, charge = battery[7]
    told = next(s for s in story if s.time_s == time_s)
    told_percent = [v.battery_percent for v in told.vehicles]
    assert charge == pytest.approx(told_percent, abs=RESOLUTION / 2)
    assert temporal(recording, "/satellites", "Scalars:scalars")[0][1] == [14.0, 13.0, 12.0]
    threshold = temporal(recording, "/alarm/threshold", "Scalars:scalars")
    assert {v for _, v in threshold for v in v} == {fake.THRESHOLD}


def test_motors_have_names_and_outputs(recording: Path, story: list[Snapshot]) -> None:
    found = temporal(recording, "/motors/rover_2", "Scalars:scalars")
    told = story[300].vehicles[1].motor_outputs
    assert at(found, 30.0) == pytest.approx(told, abs=RESOLUTION / 2)
    [(_, names)] = rows(recording, "/motors/rover_2", "SeriesLines:names")
    assert names[0] == "motor 1 (body x)"
    assert names[3] == "motor 4 (body y)"


def test_goal_distance_is_in_metres(recording: Path, story: list[Snapshot]) -> None:
    found = temporal(recording, "/goal_distance", "Scalars:scalars")
    goal = fake.view().fleet[0].goal
    north, east = story[100].vehicles[0].reported_m
    told_m = np.hypot(goal.north_m - north, goal.east_m - east)
    assert at(found, 10.0)[0] == pytest.approx(told_m, abs=RESOLUTION / 2)


def test_map_is_wgs84(recording: Path, story: list[Snapshot]) -> None:
    time_s, places = temporal(recording, "/map/fleet", "GeoPoints:positions")[30]
    told = next(s for s in story if s.time_s == time_s).vehicles[2].reported_m
    ned = wgs84_to_ned(*places[2], fake.view().origin.origin())
    assert ned == pytest.approx(told, abs=1e-4)


def test_arrows_end_with_the_order(recording: Path) -> None:
    found = temporal(recording, "/setpoint", "Arrows3D:vectors")
    pulse = next(v for t, v in found if t == pytest.approx(6.5))
    assert pulse == [pytest.approx([1.0, 0.0, 0.0], abs=1e-6)]  # 0.5 m/s to the east for 2 s
    assert found[-1][1] == []


def test_a_trail_is_the_way_driven(recording: Path, story: list[Snapshot]) -> None:
    steps = temporal(recording, "/trail", "LineStrips3D:strips")
    assert len(steps) < len(story)
    colors = temporal(recording, "/trail", "LineStrips3D:colors")
    yellow = 0xF0E442FF
    ends = [
        strip
        for (_, strips), (_, row) in zip(steps, colors, strict=True)
        for strip, color in zip(strips, row, strict=True)
        if color == yellow
    ]
    for (_, end), (start, _) in pairwise(ends):
        assert end == start
    north, east = story[-1].vehicles[1].reported_m
    assert ends[-1][1][:2] == pytest.approx([east, north], abs=0.15)


def test_posterior_and_evidence_per_hypothesis(recording: Path, story: list[Snapshot]) -> None:
    order = hypotheses(fake.view())
    told = {t.hypothesis: t for t in story[150].twins}
    for name in told:
        line = f"/belief/posterior/{name}"
        (p,) = [v for t, v in temporal(recording, line, "Scalars:scalars") if t <= 15.0][-1]
        assert p == (told[name].posterior if told[name].posterior >= LINE_TO else 0.0)
        assert [names for _, names in rows(recording, line, "SeriesLines:names")] == [[name]]
    [(_, names)] = rows(recording, "/belief/log_likelihood", "SeriesLines:names")
    assert tuple(names) == order
    evidence = at(temporal(recording, "/belief/log_likelihood", "Scalars:scalars"), 15.0)
    for name, value in zip(order, evidence, strict=True):
        if name in told:
            assert value == told[name].log_likelihood
    rest = 1.0 - sum(t.posterior for t in told.values())
    [unknown] = at(temporal(recording, "/belief/posterior/unknown", "Scalars:scalars"), 15.0)
    assert unknown == pytest.approx(rest)
    behind = at(temporal(recording, "/belief/behind_best", "Scalars:scalars"), 15.0)
    assert np.nanmax(behind) == 0.0
    assert np.nanmin(behind) >= -50.0


def test_without_a_doubt_the_belief_is_told_twice_a_second(
    recording: Path, story: list[Snapshot]
) -> None:
    line = "/belief/log_likelihood"
    times_s = [t for t, _ in temporal(recording, line, "Scalars:scalars")]
    doubted_s = [s.time_s for s in story if len(s.twins) > 1]
    assert {round(t, 3) for t in doubted_s} <= {round(t, 3) for t in times_s}
    sure_s = [t for t in times_s if t < doubted_s[0]]
    assert np.diff(sure_s) == pytest.approx(0.5)


def test_ghosts_come_and_go_with_the_doubt(recording: Path, story: list[Snapshot]) -> None:
    bodies = temporal(recording, "/twins/gps_east_stuck/body", "Cylinders3D:centers")
    doubt = [s.time_s for s in story if len(s.twins) > 1]
    assert [t for t, _ in bodies[:-1]] == pytest.approx(doubt)
    assert bodies[-1][1] == []
    told = next(t for t in story[160].twins if t.hypothesis == "gps_east_stuck")
    at_16_s = next(v for t, v in bodies if t == pytest.approx(16.0))
    assert np.array(at_16_s)[:, :2] == pytest.approx(told.true_m[:, ::-1], abs=1e-6)


def test_the_spot_is_the_report_two_sigmas_wide(recording: Path, story: list[Snapshot]) -> None:
    told = next(t for t in story[160].twins if t.hypothesis == "gps_east_stuck")
    root = "/twins/gps_east_stuck/report"
    [centre] = dict(temporal(recording, root, "Ellipsoids3D:centers"))[16.0]
    [half] = dict(temporal(recording, root, "Ellipsoids3D:half_sizes"))[16.0]
    assert centre[:2] == pytest.approx(told.report_m[1, ::-1], abs=1e-6)
    assert half[:2] == pytest.approx(2.0 * told.sigma_m[1, ::-1], abs=1e-6)


def test_phases_are_logged_when_they_change(recording: Path) -> None:
    states = temporal(recording, "/phase/fleet", "StateChange:state")
    assert [(t, v) for t, [v] in states] == [pytest.approx(row) for row in fake.PHASES]
    assert ["suspect"] in [v for _, v in temporal(recording, "/phase/rover_2", "StateChange:state")]


def test_events_have_levels(recording: Path) -> None:
    assert temporal(recording, "/events/anomaly", "TextLog:text") == [
        (7.1, ["anomaly: rover_2 does not answer to the east"])
    ]
    assert temporal(recording, "/events/anomaly", "TextLog:level") == [(7.1, ["WARN"])]
    goals = temporal(recording, "/events/goal", "TextLog:text")
    assert [t for t, _ in goals] == [36.0, 40.0, 49.0]


def test_the_brief_is_rewritten_at_the_verdict_and_the_end(recording: Path) -> None:
    pages = temporal(recording, "/brief", "TextDocument:text")
    assert [t for t, _ in pages] == [0.0, 21.0, 57.0]
    first, verdict, end = (page for _, [page] in pages)
    assert "No verdict yet" in first
    assert "rerun-sdk 0.41" in first
    assert '"control_hz": 2' in first
    assert "| motor_y_off | 0.9940 |" in verdict
    assert "all goals reached" in end
    assert "all goals reached" not in verdict


def test_learning_curves_grow_over_time_and_stand_over_steps(recording: Path) -> None:
    path = "/learning/alpha/1/attempt_1"
    told = [(t, p) for t, p in fake.progress() if (p.kind, p.attempt) == ("alpha", 1)]
    grown = temporal(recording, path, "Scalars:scalars")
    assert [v for _, [v] in grown] == pytest.approx([p.mean_reward for _, p in told])
    assert [t for t, _ in grown] == pytest.approx([t for t, _ in told], abs=0.11)
    whole = temporal(recording, path, "Scalars:scalars", timeline="training_steps")
    assert [(t, v) for t, [v] in whole] == list(fake.curve(0.99))


def test_curves_say_what_became_of_them(recording: Path) -> None:
    for attempt, outcome in ((0, "rejected"), (1, "accepted")):
        names = rows(recording, f"/learning/alpha/1/attempt_{attempt}", "SeriesLines:names")
        assert names[-1][1] == [f"attempt {attempt + 1}: ppo-mlp, {outcome}"]
        [(_, bars)] = temporal(
            recording, f"/curves/{outcome}/alpha/1/attempt_{attempt}", "BarChart:values"
        )
        assert bars


def test_plan_alpha_is_drawn_per_hypothesis_until_the_mission(recording: Path) -> None:
    plan = fake.plan_alpha().plan
    assert plan is not None
    for k, name in enumerate(fake.NAMES):
        (drawn_s, strips), (cleared_s, nothing) = temporal(
            recording, f"/plan/alpha/{name}", "LineStrips3D:strips"
        )
        assert drawn_s == pytest.approx(fake.EXPERIMENT_S)
        paths_m = plan.predicted_reports[k].transpose(1, 0, 2)[..., ::-1]
        assert np.array(strips)[..., :2] == pytest.approx(paths_m, abs=1e-6)
        assert (cleared_s, nothing) == (29.0, [])


def test_an_experiment_is_drawn_instead_of_the_one_before(tmp_path: Path) -> None:
    """First the suspect alone, under three explanations, then contact, under two."""
    first = replace(next(fake.snapshots()), phase="experiment")
    alone = Foreseen(fake.NAMES[:3], np.zeros((3, 5, 3, 2)))
    contact = Foreseen(fake.NAMES[1:3], np.ones((2, 9, 3, 2)))
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    for time_s, foreseen in ((1.0, alone), (1.1, alone), (2.0, contact), (2.1, None)):
        recorder.snapshot(replace(first, time_s=time_s, foreseen=foreseen))
    recorder.close()
    drawn = {
        name: [
            (time_s, [len(way) for way in ways])
            for time_s, ways in temporal(
                tmp_path / "a.rrd", f"/plan/alpha/{name}", "LineStrips3D:strips"
            )
        ]
        for name in fake.NAMES[:3]
    }
    assert drawn["motor_x_off"] == [(1.0, [5] * 3), (2.0, [])]
    for name in fake.NAMES[1:3]:
        assert drawn[name] == [(1.0, [5] * 3), (2.0, [9] * 3)]


def test_what_hardly_counts_is_one_row() -> None:
    posterior = {"a": 0.0002, "b": 0.7, "c": 0.2994, "d": 0.0004}
    assert ranked(posterior) == [("b", 0.7), ("c", 0.2994), ("all others", pytest.approx(0.0006))]
    assert ranked({"b": 1.0}) == [("b", 1.0)]


def test_plan_beta_is_drawn_per_vehicle_before_it_is_driven(recording: Path) -> None:
    predicted_m = fake.plan_beta().predicted_m
    assert predicted_m is not None
    [(drawn_s, strips)] = temporal(recording, "/plan/beta", "LineStrips3D:strips")
    assert drawn_s == pytest.approx(fake.PLAN_BETA_S)
    assert drawn_s < next(start_s for start_s, phase in fake.PHASES if phase == "mission")
    paths_m = predicted_m.transpose(1, 0, 2)[..., ::-1]
    assert np.array(strips)[..., :2] == pytest.approx(paths_m, abs=1e-6)


def test_a_curve_grows_on_all_timelines_and_no_point_comes_twice(recording: Path) -> None:
    for timeline in ("sim_time", "wall_time", "training_steps"):
        grown = temporal(recording, "/learning/beta/2/attempt_0", "Scalars:scalars", timeline)
        assert len({t for t, _ in grown}) == len(grown) == len(fake.curve(97.0))


def test_a_curve_that_was_not_told_while_it_grew_is_there_at_the_end(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "a.rrd", "demo", fake.view())
    recorder.plan(fake.plan_beta())
    recorder.close()
    path, steps = "/learning/beta/2/attempt_0", "training_steps"
    whole = temporal(tmp_path / "a.rrd", path, "Scalars:scalars", steps)
    assert [(t, v) for t, [v] in whole] == list(fake.curve(97.0))


def test_a_geofence_is_drawn_in_dashes_on_plane_and_map(tmp_path: Path) -> None:
    fence = Geofence(north_min_m=-2.0, north_max_m=4.0, east_min_m=-4.0, east_max_m=4.5)
    view = fake.view().model_copy(update={"geofence": fence})
    Recorder(tmp_path / "a.rrd", "demo", view).close()
    [(_, dashes)] = rows(tmp_path / "a.rrd", "/plane/geofence", "LineStrips3D:strips")
    corners = np.array(dashes).reshape(-1, 3)
    assert corners[:, 0].min() == -4.0  # east
    assert corners[:, 0].max() == 4.5
    assert corners[:, 1].min() == -2.0  # north
    assert corners[:, 1].max() == 4.0
    assert len(dashes) > 20
    [(_, on_map)] = rows(tmp_path / "a.rrd", "/map/geofence", "GeoLineStrings:line_strings")
    there_m = [wgs84_to_ned(lat, lon, view.origin.origin()) for lat, lon in on_map[0]]
    assert np.array(there_m) == pytest.approx(np.array(dashes[0])[:, 1::-1], abs=0.01)


def test_without_a_geofence_none_is_drawn(recording: Path) -> None:
    assert not {"/plane/geofence", "/map/geofence"} & entities(recording)


def test_a_minute_of_ten_vehicles_takes_two_megabytes_at_most(tmp_path: Path) -> None:
    scenario, view = crowd.fleet(10)
    station = Recorder(tmp_path / "station.rrd", "demo", view)
    truth = TruthRecorder(tmp_path / "truth.rrd", "demo", scenario)
    for snapshot in crowd.snapshots(view, seconds=60.0):
        station.snapshot(snapshot)
        truth.truth(snapshot.time_s, {v.sysid: (*v.reported_m, 0.0) for v in snapshot.vehicles})
    station.close()
    truth.close()
    merge([tmp_path / "station.rrd", tmp_path / "truth.rrd"], tmp_path / "mission.rrd")
    assert (tmp_path / "mission.rrd").stat().st_size <= 2_000_000
