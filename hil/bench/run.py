"""`hil run`: prepare, let a backend run the scenario, score, and say how it went."""

import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from hil.bench.console import Console
from hil.bench.folders import (
    Folders,
    blind_view,
    choose_folders,
    collect,
    create_folders,
    pin_ports,
    write_inputs,
)
from hil.bench.onsets import Onsets
from hil.bench.ports import choose_ports
from hil.bench.record import RunRecord
from hil.bench.recording import RecordedTruth, merge_recordings
from hil.bench.result import COMPLETED, result_tree, write_result
from hil.bench.runlog import RunLog
from hil.bench.score import score
from hil.bench.udp import Programs, UdpOptions, run_over_udp
from hil.bench.viewers import Viewer, live_viewer, until_interrupted
from hil.errors import EXIT_AS_EXPECTED, EXIT_NOT_AS_EXPECTED, HilError
from hil.mavlink import read_key
from hil.scenario import Scenario

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # SIGHUP: the terminal is gone


class Interrupted(HilError):  # noqa: N818 - said by a person, not an error
    """SIGINT, SIGTERM or SIGHUP: everything is stopped, files are kept. Exit code 128 + signal."""

    def __init__(self, number: int) -> None:
        super().__init__(f"interrupted by {signal.Signals(number).name}; files are kept")
        self.exit_code = 128 + number


@dataclass(frozen=True)
class RunOptions:
    """As on the command line; `out` None is runs/<scenario>-<timestamp>."""

    out: Path | None = None
    speed: float = 1.0
    in_memory: bool = False
    viewer: bool = False
    serve: bool = False
    signing_key: Path | None = None
    restart_station: bool = False
    programs: Programs = field(default_factory=Programs)


def run(scenario: Scenario, options: RunOptions, console: Console | None = None) -> int:
    """Returns 0 when the scenario's expectation was met, else 1.

    Raises InputError before anything is created or started, ProcessDiedError when a process dies
    or hangs, and Interrupted; what has been recorded by then is kept.
    """
    onsets = Onsets(scenario)
    if options.signing_key is not None:
        read_key(options.signing_key)
    folders = choose_folders(scenario, options.out)
    if not options.in_memory:
        scenario = pin_ports(scenario, choose_ports(scenario))
    view = blind_view(scenario)
    with ExitStack() as stack:
        with _interruptible(), console or Console() as shown:
            create_folders(folders)
            try:
                write_inputs(scenario, view, folders)
                shown.begin(scenario, folders.run, _how(options))
                viewer = _viewer(stack, options, shown)
                record, failure = _attempt(scenario, folders, options, viewer, shown, onsets)
                met = _conclude(scenario, folders, record, failure, shown)
            finally:
                collect(folders)
        if viewer.url:
            until_interrupted(viewer)
    if failure is not None:
        raise failure
    return EXIT_AS_EXPECTED if met else EXIT_NOT_AS_EXPECTED


def _viewer(stack: ExitStack, options: RunOptions, console: Console) -> Viewer:
    viewer = live_viewer(stack, options.viewer, options.serve)
    if viewer.url:
        console.say(f"look at it live: {viewer.url}")
    elif viewer.address is None and (options.viewer or options.serve):
        console.say("no viewer starts here: recording to the file only")
    return viewer


def _attempt(
    scenario: Scenario,
    folders: Folders,
    options: RunOptions,
    viewer: Viewer,
    console: Console,
    onsets: Onsets,
) -> tuple[RunRecord, HilError | None]:
    """What the backend brought about, and what cut it short, if anything did."""
    truth = RecordedTruth(folders, scenario, viewer.address)
    with RunLog(scenario, folders.run, console, truth) as log:
        try:
            _backend(scenario, folders, options, viewer, log, onsets)
        except HilError as error:
            return log.record(), error
        return log.record(), None


def _backend(
    scenario: Scenario,
    folders: Folders,
    options: RunOptions,
    viewer: Viewer,
    log: RunLog,
    onsets: Onsets,
) -> None:
    if options.in_memory:
        from hil.bench.memory import run_in_memory  # learns in this process: imports torch

        key = None if options.signing_key is None else read_key(options.signing_key)
        run_in_memory(scenario, folders.station, folders.run_id, viewer.address, log, onsets, key)
        return
    udp = UdpOptions(
        options.speed,
        viewer.address,
        options.signing_key,
        options.restart_station,
        options.programs,
    )
    run_over_udp(scenario, folders, udp, log, onsets)


def _conclude(
    scenario: Scenario,
    folders: Folders,
    record: RunRecord,
    failure: HilError | None,
    console: Console,
) -> bool:
    """Collect, merge, score, write and show; returns whether all was as expected."""
    collect(folders)
    recording = merge_recordings(folders.run)
    scored = score(scenario, record) if failure is None else None
    tree = result_tree(scenario, record, scored, COMPLETED if failure is None else str(failure))
    write_result(folders.run, tree)
    console.end(tree, scenario, recording)
    return scored is not None and scored.expected_met


def _how(options: RunOptions) -> str:
    if options.in_memory:
        return "in memory"
    if options.speed == 0.0:
        return "as fast as the station keeps up"
    return "real time" if options.speed == 1.0 else f"{options.speed:g} x real time"


@contextmanager
def _interruptible() -> Iterator[None]:
    """The first of STOPPING raises Interrupted; later ones do not disturb the stopping."""

    def raise_once(number: int, _frame: FrameType | None) -> None:
        for n in STOPPING:
            signal.signal(n, signal.SIG_IGN)
        raise Interrupted(number)

    before = {n: signal.signal(n, raise_once) for n in STOPPING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
