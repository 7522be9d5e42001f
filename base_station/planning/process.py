"""The planner as a process: requests as JSON lines on stdin, progress and plans on stdout.

`python -m base_station.planning.process STATION_VIEW`. Says `ready` when everything is compiled
and warm; ends at the end of its input or on SIGTERM; logs to stderr.
"""

import logging
import signal
import sys
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import TextIO

import numpy as np

from base_station.belief.hypotheses import SIZES, candidates
from base_station.fitted import fleet_model
from base_station.planning.attempts import Attempts
from base_station.planning.learning import ppo
from base_station.planning.learning.lesson import Lesson
from base_station.planning.learning.presets import TUNED_ALPHA
from base_station.planning.planner import in_turn, plan
from base_station.planning.problems import alpha_problem
from base_station.planning.requests import PlanRequest, decode, encode
from base_station.planning.shelf import Shelf, default_folder
from base_station.planning.tasks.alpha import AlphaTask
from base_station.planning.tasks.candidates import best_candidate
from base_station.planning.team import Team, team_size
from base_station.twin import initial_state
from hil.errors import HilError, InputError
from hil.scenario import StationView, load_station_view

READY = "ready"
LOG = logging.getLogger("planner")


def serve(view: StationView, lines: TextIO, out: TextIO) -> None:
    """Answer requests until the input ends; a line that is no request is logged and skipped.

    `ready` is said when everything that learns is warm: this process, or its workers.
    """
    size = team_size(view.planning.workers)
    if size == 1:
        warm_up(view)
        _serve(view, lines, out, in_turn)
    else:
        with Team(view, size, warm_up) as team:
            _serve(view, lines, out, team)


def _serve(view: StationView, lines: TextIO, out: TextIO, attempts: Attempts) -> None:
    shelf = Shelf(default_folder()) if view.planning.reuse else None

    def say(text: str) -> None:
        out.write(text + "\n")
        out.flush()

    say(READY)
    for line in lines:
        try:
            request = decode(line)
        except (ValueError, TypeError, KeyError) as error:
            LOG.error("ignored a line that is no request: %s", error)
            continue
        if not isinstance(request, PlanRequest):
            LOG.error("ignored a %s; only requests come in", type(request).__name__)
            continue
        LOG.info("request %d: plan %s", request.number, request.kind)
        ready = shelf.find(view, request) if shelf else None
        if ready is None:
            ready = plan(view, request, lambda progress: say(encode(progress)), attempts)
            if shelf:
                shelf.keep(view, request, ready)
        say(encode(ready))
        how = "reused" if ready.reused else "new"
        LOG.info("request %d: %d trainings, %s", request.number, len(ready.trainings), how)


def warm_up(view: StationView) -> None:
    """Compile the kernel and learn for one rollout, so that the first request is not slower."""
    start = initial_state(np.zeros((len(view.fleet), 2)), np.zeros(len(view.fleet)))
    known = candidates(view.fleet[0], view.diagnosis.priors)
    hypotheses = tuple(h for h in known if h.has_twin and h.kind not in SIZES)[:2]
    request = PlanRequest(
        number=0,
        kind="alpha",
        seed=0,
        preset="tuned",
        hypotheses=hypotheses,
        posterior=(0.5, 0.5),
        states=np.stack([apart(view, start)] * 2),
        delivered=(False,) * len(view.fleet),
    )
    problem = alpha_problem(view, request)
    preset = replace(TUNED_ALPHA, environments=4, batch_size=128, epochs=1, total_timesteps=128)
    task = AlphaTask(problem, preset.environments, np.random.default_rng(0))
    learned = ppo.train(Lesson(task, preset, 0, lambda _: False, lambda *_: None))
    best_candidate(problem, learned.actor, 0)


def apart(view: StationView, start: np.ndarray) -> np.ndarray:
    """The start with its vehicles in a row, out of each other's reach."""
    model = fleet_model(view)
    start = start.copy()
    start[:, 0] = 3.0 * float(model.vehicles.radius_m.max()) * np.arange(model.size)
    return start


def main(arguments: list[str]) -> int:
    if len(arguments) != 1:
        print("usage: python -m base_station.planning.process STATION_VIEW", file=sys.stderr)
        return InputError.exit_code
    logging.basicConfig(stream=sys.stderr, level=logging.INFO, format="%(name)s: %(message)s")
    signal.signal(signal.SIGTERM, _leave)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the station's; it then ends the input
    try:
        serve(load_station_view(Path(arguments[0])), sys.stdin, sys.stdout)
    except HilError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    except BrokenPipeError:
        return 0
    return 0


def _leave(_signal: int, _frame: FrameType | None) -> None:
    raise SystemExit(0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
