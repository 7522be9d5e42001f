"""Pictures of a recording without a screen: the viewer runs headless and is driven by its API."""

import io
import os
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from PIL import Image
from rerun.experimental import ViewerClient

from base_station.recording.binary import rerun
from base_station.recording.blueprint import TABS
from base_station.recording.columns import SIM_TIME
from hil.errors import HilError, InputError

SIZE = (1280, 720)
MENU = 37  # height of the menu bar, which is left off
TOASTS_S = 6.0  # messages at start-up cover the picture for so long
START_S, LOAD_S, SETTLE_S, POLL_S = 30.0, 60.0, 15.0, 0.2


def screenshot(rrd: Path, time_s: float, out_png: Path, view: str | None = None) -> None:
    """One picture at sim_time `time_s`: of a tab (`TABS`), or of one view by its title's start.

    Raises InputError for an unknown view, HilError where no viewer can run.
    """
    with headless(rrd) as viewer:
        viewer.shoot(time_s, out_png, view)


@contextmanager
def headless(rrd: Path | None = None) -> Iterator["Viewer"]:
    """A headless viewer, with a recording open. Needs a Vulkan driver (`mesa-vulkan-drivers`)."""
    port = _free_port()
    width, height = SIZE[0], SIZE[1] + MENU
    command = rerun("--headless", "--bind", "127.0.0.1")
    command += ["--port", str(port), "--window-size", f"{width}x{height}"]
    command += ["--hide-welcome-screen", "--memory-limit", "2GiB"]
    process = subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "CI": "1"},  # otherwise it looks for news on the network
    )
    try:
        viewer = Viewer(_connect(process, port), f"127.0.0.1:{port}", process.pid)
        if rrd is not None:
            viewer.open(rrd)
        yield viewer
    finally:
        process.kill()
        process.wait()


class Viewer:
    """Drives one viewer."""

    def __init__(self, client: Any, address: str, pid: int) -> None:
        self._client, self.address, self.pid = client, address, pid
        self._started_s = time.monotonic()

    def open(self, rrd: Path) -> None:
        """Show a file."""
        self._client.open(str(rrd.resolve()))
        self._wait(lambda state: not state.loading, f"{rrd}: not loaded")

    def wait_for(self, run_id: str) -> None:
        """Until a recording that is streamed in is there and shown."""
        self._wait(
            lambda state: any(run_id in str(r) for r in state.recordings) and bool(state.views),
            f"{run_id}: not heard of",
        )

    def _wait(self, holds: Callable[[Any], bool], what: str) -> None:
        deadline_s = time.monotonic() + LOAD_S
        while not holds(self._client.get_state()):
            if time.monotonic() > deadline_s:
                raise HilError(f"{what} by the viewer after {LOAD_S:g} s")
            time.sleep(POLL_S)

    def shoot(self, time_s: float, out_png: Path, view: str | None = None) -> None:
        """A picture at a time; see `screenshot`."""
        layout = _Layout(self._client.get_blueprint().blueprint)
        tab, view_id = layout.find(view or TABS[0])
        self._client.set_blueprint(layout.with_tab(tab), of="recording")
        self._client.set_time(SIM_TIME, duration=time_s, play_state="paused")
        time.sleep(max(0.0, self._started_s + TOASTS_S - time.monotonic()))
        out_png.write_bytes(self._settled(view_id) if view_id else _cropped(self._settled(None)))

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


class _Layout:
    """A blueprint as the viewer tells it: {path: {archetype: fields}}."""

    def __init__(self, tree: dict[str, Any]) -> None:
        self._tree = tree
        self._nodes = {path.strip("/"): fields for path, fields in tree.items()}
        self._tabs = next(
            path for path in self._nodes if tuple(map(self._title, self._inside(path))) == TABS
        )

    def find(self, name: str) -> tuple[int, str | None]:
        """The tab called `name`; or the first view whose title starts so, and the tab it is in."""
        if name in TABS:
            return TABS.index(name), None
        titles = []
        for tab, path in enumerate(self._inside(self._tabs)):
            for view in self._views(path):
                titles.append(self._title(view))
                if titles[-1].startswith(name):
                    return tab, view.removeprefix("view/")
        known = ", ".join([*TABS, *dict.fromkeys(titles)])
        raise InputError(f"view {name!r}: there is none; try one of {known}")

    def with_tab(self, tab: int) -> dict[str, Any]:
        """The tree with another tab in front."""
        fields = self._nodes[self._tabs]["ContainerBlueprint"]
        fields["active_tab"] = self._inside(self._tabs)[tab]
        return self._tree

    def _views(self, path: str) -> list[str]:
        if path.startswith("view/"):
            return [path]
        return [view for child in self._inside(path) for view in self._views(child)]

    def _inside(self, path: str) -> list[str]:
        container = self._nodes[path].get("ContainerBlueprint", {})
        return [child.strip("/") for child in container.get("contents", ())]

    def _title(self, path: str) -> str:
        fields = self._nodes[path]
        kind = "ViewBlueprint" if path.startswith("view/") else "ContainerBlueprint"
        return str(fields.get(kind, {}).get("display_name"))


def _cropped(png: bytes) -> bytes:
    """Without the menu bar."""
    with Image.open(io.BytesIO(png)) as image:
        width, height = image.size
        part = image.convert("RGB").crop((0, MENU, width, height))
    cropped = io.BytesIO()
    part.save(cropped, "PNG", optimize=True)
    return cropped.getvalue()


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
