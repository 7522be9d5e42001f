"""A planner that is killed at work is started again, and asked again what it had not answered."""

import select
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from base_station.planner_child import RESTARTS, PlannerChild
from base_station.planning.requests import PlanReady, PlanRequest
from hil.errors import ProcessDiedError

STUB = str(Path(__file__).with_name("stub_planner.py"))
PATIENCE_S = 60.0
REQUEST = PlanRequest(7, "alpha", 1, "tuned", (), (), np.zeros((0, 3, 6)), (False,) * 3)


def planner(folder: Path, deaths: int) -> PlannerChild:
    memory = folder / "deaths"
    memory.write_text(str(deaths))
    program = (sys.executable, STUB, str(memory))
    return PlannerChild(folder / "view.json", folder / "planner.log", program)


def answers(child: PlannerChild) -> Iterator[PlanReady]:
    """As the station waits for them."""
    while select.select([child.fileno()], [], [], PATIENCE_S)[0]:
        yield from (m for m in child.poll() if isinstance(m, PlanReady))


def test_it_answers_though_it_was_killed(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with closing(planner(tmp_path, RESTARTS)) as child:
        first = child.pid
        child.submit(REQUEST)
        assert next(answers(child)) == PlanReady(7, "alpha", ())
        assert child.pid != first
    assert capfd.readouterr().err.count("planner was killed by SIGKILL: started again") == RESTARTS


def test_one_that_dies_again_and_again_is_given_up(tmp_path: Path) -> None:
    with closing(planner(tmp_path, RESTARTS + 1)) as child:
        child.submit(REQUEST)
        with pytest.raises(ProcessDiedError, match="planner died"):
            next(answers(child))
