"""Pictures of a recording without a screen: the viewer runs headless and is driven by its API."""

import os
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import rerun_cli
from rerun.experimental import ViewerClient

from base_station.recording.blueprint import TABS
from base_station.recording.columns import SIM_TIME
from hil.errors import HilError, InputError

SIZE = (1280, 720)
TOASTS_S = 6.0  # messages at start-up cover the picture for so long
START_S, LOAD_S, SETTLE_S, POLL_S = 30.0, 60.0, 15.0, 0.2


def screenshot(rrd: Path, time_s: float, out_png: Path, view: str | None = None) -> None:
    """One picture at sim_time `time_s`: of a tab (`TABS`), or of one view by its title's start.

    Raises InputError for an unknown view, HilError where no viewer can run.
    """
    with headless(rrd) as viewer:
        viewer.shoot(time_s, out_png, view)


@contextmanager
def headless(rrd: Path) -> Iterator["Viewer"]:
    """A headless viewer with a recording open. Needs a Vulkan driver (`mesa-vulkan-drivers`)."""
    port = _free_port()
    width, height = SIZE
    command = [str(Path(rerun_cli.__file__).parent / "rerun"), "--headless", "--bind", "127.0.0.1"]
    command += ["--port", str(port), "--window-size", f"{width}x{height}"]
    command += ["--hide-welcome-screen", "--memory-limit", "2GiB"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "CI": "1"},  # otherwise it looks for news on the network
    )
    try:
        viewer = Viewer(_connect(process, port), time.monotonic())
        viewer.open(rrd)
        yield viewer
    finally:
        process.kill()
        process.wait()


class Viewer:
    """Drives one viewer."""

    def __init__(self, client: Any, started_s: float) -> None:
        self._client, self._started_s = client, started_s

    def open(self, rrd: Path) -> None:
        self._client.open(str(rrd.resolve()))
        deadline_s = time.monotonic() + LOAD_S
        while self._client.get_state().loading:
            if time.monotonic() > deadline_s:
                raise HilError(f"{rrd}: not loaded by the viewer after {LOAD_S:g} s")
            time.sleep(POLL_S)

    def shoot(self, time_s: float, out_png: Path, view: str | None = None) -> None:
        """A picture at a time; see `screenshot`."""
        view_id = None
        if view in TABS or view is None:
            self._show_tab(view or TABS[0])
        else:
            view_id = self._find(view)
        self._client.set_time(SIM_TIME, duration=time_s, play_state="paused")
        time.sleep(max(0.0, self._started_s + TOASTS_S - time.monotonic()))
        out_png.write_bytes(self._settled(view_id))

    def warnings(self) -> list[str]:
        """What the views now shown complain about."""
        return [f"{v.name}: {r}" for v in self._client.get_state().views for r in v.reports]

    def _settled(self, view_id: str | None) -> bytes:
        """A picture that no longer changes."""
        deadline_s = time.monotonic() + SETTLE_S
        last, now = b"", bytes(self._client.take_screenshot(view_id=view_id))
        while now != last and time.monotonic() < deadline_s:
            time.sleep(POLL_S)
            last, now = now, bytes(self._client.take_screenshot(view_id=view_id))
        return now

    def _show_tab(self, name: str) -> None:
        tree = self._client.get_blueprint().blueprint
        titles = {
            path.strip("/"): fields[kind].get("display_name")
            for path, fields in tree.items()
            for kind in ("ContainerBlueprint", "ViewBlueprint")
            if kind in fields
        }
        for fields in tree.values():
            tabs = fields.get("ContainerBlueprint", {})
            contents = [path.strip("/") for path in tabs.get("contents", ())]
            if tuple(titles.get(path) for path in contents) == TABS:
                tabs["active_tab"] = contents[TABS.index(name)]
        self._client.set_blueprint(tree, of="recording")

    def _find(self, title: str) -> str:
        views = self._client.get_state().views
        for view in views:
            if view.name.startswith(title):
                return str(view.view_id)
        names = ", ".join(sorted({v.name for v in views}))
        raise InputError(f"view {title!r}: there is none; try {', '.join(TABS)}, {names}")


def _connect(process: subprocess.Popen[bytes], port: int) -> Any:
    deadline_s = time.monotonic() + START_S
    while True:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
            return client
        except Exception:
            if process.poll() is not None or time.monotonic() > deadline_s:
                raise HilError(
                    "the headless Rerun viewer does not start; is a Vulkan driver installed "
                    "(Debian: mesa-vulkan-drivers libvulkan1)?"
                ) from None
            time.sleep(POLL_S)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
