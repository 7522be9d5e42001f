"""Where a run keeps its files: its folder, and the neutral one the station works in."""

import secrets
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from hil.bench.ports import PortBases
from hil.errors import InputError
from hil.link import MAVLINK_PORT_BASE
from hil.scenario import Scenario, StationView, station_view

VIEW_FILE = "view.json"
SCENARIO_FILE = "scenario.yaml"
_STATION_STREAM = 0x5354


@dataclass(frozen=True)
class Folders:
    """`run` is for people. The station sees only `station`, whose path tells it nothing."""

    run: Path
    station: Path

    @property
    def run_id(self) -> str:
        """Joins the recordings of a run; as opaque as the folder it names."""
        return self.station.name.removeprefix(".station-")


def choose_folders(scenario: Scenario, out: Path | None) -> Folders:
    """Names only; nothing is created. Raises InputError when `out` holds something already."""
    if out is None:
        out = _fresh(Path("runs") / f"{scenario.name}-{time.strftime('%Y%m%dT%H%M%S')}")
    elif _is_taken(out):
        raise InputError(f"--out {out}: exists and is not an empty folder; choose another")
    return Folders(out, out.absolute().parent / f".station-{secrets.token_hex(8)}")


def create_folders(folders: Folders) -> None:
    """Raises InputError when they cannot be made."""
    try:
        folders.run.mkdir(parents=True, exist_ok=True)
        folders.station.mkdir()
    except OSError as error:
        raise InputError(
            f"--out {folders.run}: cannot be created: {error.strerror}; choose another"
        ) from None


def pin_ports(scenario: Scenario, ports: PortBases) -> Scenario:
    """The scenario with its ports filled in."""
    links = {
        "physics_port_base": ports.physics,
        "mavlink_port_base": ports.mavlink,
        "injector_port_base": ports.injector,
    }
    return scenario.model_copy(update={"links": scenario.links.model_copy(update=links)})


def blind_view(scenario: Scenario) -> StationView:
    """What the station is told, with a random stream of its own: no seed of the world in it."""
    state = np.random.SeedSequence((scenario.seed, _STATION_STREAM)).generate_state(1)
    port_base = scenario.links.mavlink_port_base or MAVLINK_PORT_BASE
    return station_view(scenario, port_base, int(state[0]) & 0x7FFFFFFF)


def write_inputs(scenario: Scenario, view: StationView, folders: Folders) -> None:
    """The scenario as it is run, for world and vehicles; the view, for the station."""
    tree = scenario.model_dump(mode="json", exclude_none=True)
    text = yaml.safe_dump(tree, sort_keys=False, allow_unicode=True)
    (folders.run / SCENARIO_FILE).write_text(text, encoding="utf-8")
    (folders.station / VIEW_FILE).write_text(view.model_dump_json(indent=2), encoding="utf-8")


def collect(folders: Folders) -> None:
    """Move what the station wrote into the run's folder; what is there already keeps its name.

    Does nothing the second time.
    """
    if not folders.station.exists():
        return
    for item in sorted(folders.station.iterdir()):
        target = folders.run / item.name
        if target.exists():
            target = folders.run / f"station-{item.name}"
        shutil.move(item, target)
    folders.station.rmdir()


def _is_taken(out: Path) -> bool:
    """Raises InputError where one may not even look."""
    try:
        return out.exists() and (not out.is_dir() or any(out.iterdir()))
    except OSError as error:
        raise InputError(f"--out {out}: {error.strerror}; choose another") from None


def _fresh(folder: Path) -> Path:
    """`folder`, or `folder-2`, ... when it exists."""
    candidate, count = folder, 1
    while candidate.exists():
        count += 1
        candidate = folder.with_name(f"{folder.name}-{count}")
    return candidate
