"""Viewers for people: of a run while it lasts, and of its recording afterwards.

They listen on this machine only. Whatever becomes of them, the run goes on.
"""

import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

from hil.bench.recording import RECORDING, merge_recordings
from hil.errors import HilError, InputError

HOST = "127.0.0.1"
START_S, STOP_S, POLL_S = 15.0, 3.0, 0.1


@dataclass(frozen=True)
class Viewer:
    """Recorders stream to `address` (host:port; None: nowhere), a browser opens `url`."""

    address: str | None = None
    url: str | None = None


def recording_of(run: Path) -> Path:
    """The recording of a run's folder, or `run` itself. Raises InputError when there is none."""
    if run.is_file():
        return run
    if run.is_dir() and (found := merge_recordings(run)) is not None:
        return found
    raise InputError(f"{run}: no {RECORDING} there; name the folder of a run, or an .rrd file")


def shoot(run: Path, time_s: float, out: Path, view: str | None) -> None:
    """A picture of a run. Raises InputError for an unknown view, HilError without a viewer."""
    from base_station.recording.screenshot import screenshot

    screenshot(recording_of(run), time_s, out, view)


def open_viewer() -> str | None:
    """The address of a native viewer: of one that runs, or a new one, which stays after the run."""
    from base_station.recording.streams import VIEWER

    port = int(VIEWER.split(":")[1])
    if _listens(port):
        return VIEWER
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(
        _rerun("--port", str(port)), stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True
    )
    return VIEWER if _up(process, [port]) else None


@contextmanager
def serve_web(recording: Path | None = None) -> Iterator[Viewer]:
    """A web viewer, of a recording or of what is streamed to it. Raises HilError without one."""
    grpc, web = _free_port(), _free_port()
    arguments = ["--serve-web", "--port", str(grpc), "--web-viewer-port", str(web)]
    if recording is not None:
        arguments.append(str(recording.resolve()))
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(_rerun(*arguments), stdin=quiet, stdout=quiet, stderr=quiet)
    try:
        if not _up(process, [grpc, web]):
            raise HilError("the web viewer does not start")
        source = quote(f"rerun+http://{HOST}:{grpc}/proxy", safe="")
        yield Viewer(f"{HOST}:{grpc}", f"http://{HOST}:{web}/?url={source}&theme=dark")
    finally:
        process.terminate()
        with suppress(subprocess.TimeoutExpired):
            process.wait(STOP_S)
        process.kill()
        process.wait()


def live_viewer(stack: ExitStack, native: bool, web: bool) -> Viewer:
    """What a run streams to, until `stack` closes it. Without a viewer the run goes on."""
    if web:
        with suppress(HilError):
            return stack.enter_context(serve_web())
    return Viewer(open_viewer() if native else None)


def view(run: Path, web: bool) -> int:
    """Show a recording until the viewer is closed; in a browser, until Ctrl-C."""
    recording = recording_of(run)
    if web:
        with serve_web(recording) as viewer:
            until_interrupted(viewer)
        return 0
    code = subprocess.run(
        _rerun("--port", "auto", str(recording.resolve())), check=False
    ).returncode
    if code:
        raise HilError(f"the viewer ended with exit code {code}; without a screen, try --web")
    return 0


def until_interrupted(viewer: Viewer) -> None:
    """Leave a web viewer to a person, if one is at the terminal."""
    print(f"{viewer.url}  (Ctrl-C ends it)", flush=True)
    with suppress(KeyboardInterrupt):
        while sys.stdin.isatty():
            time.sleep(1.0)


def _rerun(*arguments: str) -> Sequence[str]:
    from base_station.recording.binary import rerun

    return rerun("--bind", HOST, *arguments)


def _up(process: subprocess.Popen[bytes], ports: Sequence[int]) -> bool:
    """Whether all ports listen soon; not, when the process ends before."""
    deadline_s = time.monotonic() + START_S
    while process.poll() is None and time.monotonic() < deadline_s:
        if all(map(_listens, ports)):
            return True
        time.sleep(POLL_S)
    return False


def _listens(port: int) -> bool:
    with suppress(OSError):
        socket.create_connection((HOST, port), timeout=0.3).close()
        return True
    return False


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])
