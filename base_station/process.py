"""`base-station STATION_VIEW`: the thin shell with the sockets, the clocks and the files."""

import argparse
import gc
import json
import os
import select
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from base_station import twin
from base_station.belief.watch import Baseline, Watch
from base_station.execution import hold
from base_station.field.budget import refuse_overload
from base_station.field.consent import ask_before_arming
from base_station.field.dry import DryEnd
from base_station.field.keys import Typed, emergency_key
from base_station.fitted import fleet_model
from base_station.journal import Head, Journal, journal_files
from base_station.listeners import open_listeners
from base_station.node import StationNode
from base_station.parts import Room
from base_station.planner_child import PlannerChild
from base_station.receiving.telemetry import Frame
from base_station.recording.streams import VIEWER
from base_station.resuming import Resumed, resume
from base_station.wiring import open_links
from hil.errors import HilError, InputError
from hil.mavlink import read_key
from hil.options import Parser, megabytes
from hil.scenario import StationView, load_station_view

VIEW_FILE = "view.json"
STEP_S = 0.05  # 20 Hz when nothing arrives


class StopRequested(Exception):  # noqa: N818 - not an error
    """SIGTERM, SIGINT or SIGHUP (the terminal is gone): hold the fleet, stop tidily."""


class EmergencyStop(StopRequested):
    """SIGUSR1, or the space bar: motors off."""


def main(argv: Sequence[str] | None = None) -> None:
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, _terminate)
    signal.signal(signal.SIGUSR1, _emergency)
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
        nargs="?",
        metavar="FLEET",
        help="a fleet file, or what `hil station-view SCENARIO` prints",
    )
    parser.add_argument("--out", type=Path, default=Path("."), help="where logs are written")
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="DIR",
        help="go on where the station that wrote into this folder ended",
    )
    parser.add_argument(
        "--signing-key", type=Path, metavar="FILE", help="sign MAVLink with the pass phrase in it"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="send nothing; show what would be sent"
    )
    parser.add_argument("--machine", action="store_true", help="JSON lines instead of text")
    parser.add_argument(
        "--viewer",
        nargs="?",
        const=VIEWER,
        metavar="HOST:PORT",
        help=f"stream to the Rerun viewer there, if one runs; without an address {VIEWER}",
    )
    parser.add_argument(
        "--keep-mb",
        type=megabytes,
        metavar="MB",
        help="of telemetry logs and recording, keep the newest (default: all)",
    )
    parser.add_argument("--run-id", default=None, help="recording id, to share one recording")
    arguments = parser.parse_args(argv)
    if (arguments.view is None) == (arguments.resume is None):
        parser.error("give a FLEET, or --resume DIR, one of the two")
    return arguments


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise StopRequested


def _emergency(_signal: int, _frame: FrameType | None) -> None:
    raise EmergencyStop


def run(arguments: argparse.Namespace) -> None:
    """Raises InputError for bad input or a busy port, ProcessDiedError when the planner dies."""
    key = None if arguments.signing_key is None else read_key(arguments.signing_key)
    resumed = None if arguments.resume is None else resume(arguments.resume, key)
    view = load_station_view(arguments.view) if resumed is None else resumed.view
    out = arguments.out if resumed is None else arguments.resume
    say = _say_json if arguments.machine else _say_text
    run_id = arguments.run_id or f"station-{os.getpid()}"
    refuse_overload(view)
    with ExitStack() as stack:
        links = open_links(stack, view)
        if resumed is None and not arguments.dry_run:
            ask_before_arming(view)
        if arguments.dry_run:
            links = [
                DryEnd(link, m.name, lambda text: print(text, flush=True))
                for link, m in zip(links, view.fleet, strict=True)
            ]
        for connection in dict.fromkeys(map(view.connection_of, view.fleet)):
            if connection.kind == "udpin" and not connection.is_on_this_machine:
                print(f"listens to other machines, too: {connection}", file=sys.stderr, flush=True)
        _make_folder(out)
        parts = len(journal_files(out)) if resumed else 0
        journal = _open_journal(out, Head(view.model_dump(mode="json"), parts > 0, key is not None))
        stack.callback(journal.close)
        view_file = arguments.view or _written_view(out, view)
        planner = PlannerChild(view_file, out / "planner.log")
        stack.callback(planner.close)
        room = Room.of_megabytes(arguments.keep_mb)
        listeners = open_listeners(stack, out, run_id, view, arguments.viewer, say, parts, room)
        _compile_twin(view)
        gc.collect()
        gc.freeze()  # what is there by now stays: looking through it again takes 0.2 s
        offset_s = 0.0
        if resumed is None:
            node = StationNode(view, links, planner, listeners, journal, key)
        else:
            node = resumed.node
            node.take_over(links, planner, listeners, journal)
            offset_s = resumed.wall_offset_s(time.monotonic(), time.time_ns() // 1000)
            _say_resumed(resumed)
        for index, link in enumerate(links):
            link.guard(partial(node.is_welcome, index), partial(node.hear_of, index))
        say({"type": "ready", "planner_pid": planner.pid})
        keys = stack.enter_context(emergency_key(sys.stdin))
        try:
            while not node.finished:
                sources = [*(link.fileno() for link in links), planner.fileno(), *keys.filenos()]
                ready, _, _ = select.select(sources, [], [], STEP_S)
                typed = keys.typed(ready)
                if typed is Typed.STOP:
                    raise EmergencyStop
                if typed is Typed.GIVE_BACK:
                    node.give_back()
                if typed is Typed.GONE:
                    raise StopRequested
                node.step(time.monotonic() + offset_s, time.time_ns() // 1000)
        except EmergencyStop:
            node.emergency_stop()
            raise
        except BaseException:  # our own failure, too: nobody drives on unheeded
            node.hold_all()
            raise


def _open_journal(out: Path, head: Head) -> Journal:
    try:
        return Journal(out, head)
    except OSError as error:
        raise InputError(
            f"{out}: the journal cannot be written: {error.strerror}; choose another folder"
        ) from None


def _written_view(out: Path, view: StationView) -> Path:
    """The view as a file, which the planner reads."""
    path = out / VIEW_FILE
    if not path.exists():
        path.write_text(view.model_dump_json(indent=2), encoding="utf-8")
    return path


def _say_resumed(resumed: Resumed) -> None:
    print(f"resumed after {resumed.steps} steps", file=sys.stderr, flush=True)
    if resumed.differs:
        print(
            f"the journal tells of an event that this station would not have told: "
            f"{resumed.differs}; was it another version?",
            file=sys.stderr,
            flush=True,
        )


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
    watch = Watch(view, Baseline(fleet_model(view)), state, 0.0)
    still, fresh = np.zeros((len(goals), 2)), np.ones(len(goals), dtype=np.bool_)
    none = np.zeros(len(goals))
    frame = Frame(0.0, still, still, none, fresh, fresh, none, none, none, ~fresh)
    watch.tick(frame, hold(len(goals)))


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
