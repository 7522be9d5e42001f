"""`base-station STATION_VIEW`: the thin shell with the sockets, the clocks and the files."""

import argparse
import json
import os
import select
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from base_station import twin
from base_station.execution import hold
from base_station.listeners import open_listeners
from base_station.node import StationNode
from base_station.planner_child import PlannerChild
from base_station.recording.streams import VIEWER
from base_station.telemetry import Frame
from base_station.watch import Baseline, Watch
from base_station.wiring import open_links
from hil.errors import HilError, InputError
from hil.options import Parser
from hil.scenario import StationView, load_station_view

STEP_S = 0.05  # 20 Hz when nothing arrives


class StopRequested(Exception):  # noqa: N818 - not an error
    """SIGTERM or SIGINT: stop tidily."""


def main(argv: Sequence[str] | None = None) -> None:
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, _terminate)
    try:
        run(_arguments(argv))
    except StopRequested:
        sys.exit(0)
    except HilError as error:
        print(f"base-station: {error}", file=sys.stderr)
        sys.exit(error.exit_code)


def _arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="base-station",
        description="Find out what is broken in a fleet, over MAVLink, and finish its mission.",
    )
    parser.add_argument(
        "view",
        type=Path,
        metavar="FLEET",
        help="a fleet file, or what `hil station-view SCENARIO` prints",
    )
    parser.add_argument("--out", type=Path, default=Path("."), help="where logs are written")
    parser.add_argument("--machine", action="store_true", help="JSON lines instead of text")
    parser.add_argument(
        "--viewer",
        nargs="?",
        const=VIEWER,
        metavar="HOST:PORT",
        help=f"stream to the Rerun viewer there, if one runs; without an address {VIEWER}",
    )
    parser.add_argument("--run-id", default=None, help="recording id, to share one recording")
    return parser.parse_args(argv)


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise StopRequested


def run(arguments: argparse.Namespace) -> None:
    """Raises InputError for a bad view or a busy port, ProcessDiedError when the planner dies."""
    view = load_station_view(arguments.view)
    say = _say_json if arguments.machine else _say_text
    run_id = arguments.run_id or f"station-{os.getpid()}"
    with ExitStack() as stack:
        links = open_links(stack, view)
        _make_folder(arguments.out)
        planner = PlannerChild(arguments.view, arguments.out / "planner.log")
        stack.callback(planner.close)
        listeners = open_listeners(stack, arguments.out, run_id, view, arguments.viewer, say)
        _compile_twin(view)
        node = StationNode(view, links, planner, listeners)
        say({"type": "ready", "planner_pid": planner.pid})
        while not node.finished:
            select.select([*(link.fileno() for link in links), planner.fileno()], [], [], STEP_S)
            node.step(time.monotonic(), time.time_ns() // 1000)


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"--out {out}: cannot be created: {error.strerror}; choose another"
        ) from None


def _compile_twin(view: StationView) -> None:
    """The first call compiles the kernel, which takes seconds; later no step may."""
    goals = [[m.goal.north_m, m.goal.east_m] for m in view.fleet]
    state = twin.initial_state(goals, [0.0] * len(goals))
    watch = Watch(view, Baseline(twin.FleetModel.from_view(view)), state, 0.0)
    watch.tick(
        Frame(0.0, state[:, :2], state[:, 3:5], state[:, 2], np.ones(len(goals), dtype=np.bool_)),
        hold(len(goals)),
    )


def _say_json(line: dict[str, Any]) -> None:
    print(json.dumps(line), flush=True)


def _say_text(line: dict[str, Any]) -> None:
    """For a person who started the station by hand."""
    match line["type"]:
        case "event":
            print(f"{line['time_s']:8.2f} s  {line['kind']:<10} {line['text']}", flush=True)
        case "progress":
            print(
                f"            learning {line['kind']} (attempt {line['attempt'] + 1}): "
                f"{line['timesteps']}/{line['total_timesteps']} steps, "
                f"reward {line['mean_reward']:.2f}",
                flush=True,
            )
        case "ready":
            print("ready", flush=True)
        case "result":
            print(json.dumps(line["outcome"], indent=2), flush=True)
        case _:
            pass


if __name__ == "__main__":
    main()
