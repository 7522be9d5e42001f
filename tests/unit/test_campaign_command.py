"""A campaign from file to table, with runs that cost nothing: resuming, failing, reporting."""

import json
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
from campaign_builders import healthy, row, write
from rich.console import Console

from hil.bench.campaign.backends import ray
from hil.bench.campaign.command import CampaignOptions, run_campaign
from hil.bench.campaign.journal import JOURNAL_FILE, Journal
from hil.bench.campaign.plan import RunSpec
from hil.bench.campaign.row import Row
from hil.bench.campaign.table import TABLE_FILE
from hil.errors import InputError


def pretended(spec: RunSpec) -> Row:
    """A run in no time."""
    made = row if spec.point["fault"] == "motor_y_off" else healthy
    return made(key=spec.key, point=spec.point, layout=spec.layout, repeat=spec.repeat)


class Counting:
    """Pretends, counts, and is killed before run number `dies_at`."""

    def __init__(self, dies_at: int | None = None) -> None:
        self.done: list[str] = []
        self._dies_at = dies_at

    def __call__(self, spec: RunSpec) -> Row:
        if len(self.done) == self._dies_at:
            raise KeyboardInterrupt
        self.done.append(spec.key)
        return pretended(spec)


def campaign(
    tmp_path: Path, work: Callable[[RunSpec], Row], **changes: Any
) -> tuple[int, str, list[dict[str, Any]]]:
    """Exit code, what was said, and the table."""
    said, out = StringIO(), tmp_path / "out"
    options = CampaignOptions(out=out, jobs=1)
    code = run_campaign(write(tmp_path, **changes), options, work, Console(file=said))
    return code, said.getvalue(), pq.read_table(out / TABLE_FILE).to_pylist()


def test_the_table_has_a_row_for_every_run_in_the_order_of_the_plan(tmp_path: Path) -> None:
    code, said, table = campaign(tmp_path, pretended)
    assert code == 0
    assert "4 of 4 runs, 0 failed" in said
    assert [(r["layout"], r["point_fault"]) for r in table] == [
        (0, "none"), (0, "motor_y_off"), (1, "none"), (1, "motor_y_off"),
    ]  # fmt: skip
    assert all(r["correct"] for r in table)
    assert table[1]["delay_s"] == pytest.approx(1.5)
    assert dict(table[1]["posterior"]) == {"motor_y_off": 0.99, "none": 0.01}


@pytest.mark.parametrize("dies_at", [0, 1, 3])
def test_after_a_kill_no_run_is_repeated_and_none_is_lost(tmp_path: Path, dies_at: int) -> None:
    first, second = Counting(dies_at), Counting()
    with pytest.raises(KeyboardInterrupt):
        campaign(tmp_path, first)
    _, said, table = campaign(tmp_path, second)
    assert f"4 runs, {dies_at} done already" in said
    assert len(first.done) == dies_at
    assert sorted([*first.done, *second.done]) == sorted(r["key"] for r in table)
    assert len({r["key"] for r in table}) == 4


def test_a_torn_last_line_is_one_run_that_is_done_again(tmp_path: Path) -> None:
    campaign(tmp_path, pretended)
    journal = tmp_path / "out" / JOURNAL_FILE
    whole = journal.read_bytes()
    torn = json.loads(whole.splitlines()[-1])["key"]
    journal.write_bytes(whole[:-20])
    again = Counting()
    _, _, table = campaign(tmp_path, again)
    assert again.done == [torn]
    assert len(table) == 4
    assert journal.read_bytes() == whole


def test_a_larger_campaign_goes_on_from_a_smaller_one(tmp_path: Path) -> None:
    campaign(tmp_path, pretended)
    more = Counting()
    _, said, table = campaign(tmp_path, more, layouts={"count": 3})
    assert len(more.done) == 2
    assert len(table) == 6
    other = Counting()
    _, said, table = campaign(tmp_path, other, layouts={"count": 1}, split="test")
    assert len(other.done) == len(table) == 2
    assert "6 there belong to another plan or program" in said


def test_a_run_that_fails_is_a_row_and_exit_code_1(tmp_path: Path) -> None:
    def fails_once(spec: RunSpec) -> Row:
        made = pretended(spec)
        return made if spec.layout else row(**{**made.tree(), "error": "ValueError: broken"})

    code, said, table = campaign(tmp_path, fails_once)
    assert code == 1
    assert "4 runs, 2 failed" in said
    assert "ValueError: broken" in said
    assert [r["error"] for r in table] == ["ValueError: broken"] * 2 + [""] * 2


def test_the_report_stands_alone(tmp_path: Path) -> None:
    campaign(tmp_path, pretended, undiagnosable=[["gps_noise", "gps_delay"]])
    page = (tmp_path / "out" / "report.html").read_text()
    images = sorted(p.name for p in (tmp_path / "out" / "report").glob("*.png"))
    assert images == [
        "calibration.png", "confusion.png", "impulses.png", "risk_coverage.png", "times.png",
    ]  # fmt: skip
    assert page.count("data:image/png;base64,") == len(images)
    for outside in ("http:", "https:", "<script", 'src="/'):
        assert outside not in page
    for told in ("motor_y_off", "Brier skill", "false alarms per vehicle-hour", "oracle"):
        assert told in page


def test_only_failures_still_make_a_report(tmp_path: Path) -> None:
    code, _, table = campaign(tmp_path, lambda s: row(key=s.key, point=s.point, error="E: x"))
    assert (code, len(table)) == (1, 4)


def test_two_campaigns_cannot_write_to_one_folder(tmp_path: Path) -> None:
    with Journal(tmp_path / "out"), pytest.raises(InputError, match="another campaign writes here"):
        campaign(tmp_path, pretended)
    campaign(tmp_path, pretended)


def test_a_journal_of_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / JOURNAL_FILE).write_text('{"key": 1}\n')
    with pytest.raises(InputError, match="line 1 is no run of this version"):
        campaign(tmp_path, pretended)


def test_without_ray_its_backend_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "ray", None)
    with pytest.raises(InputError, match=r"Ray is not installed; pip install 'hil-fleet\[ray\]'"):
        next(ray(pretended, (), 1))
