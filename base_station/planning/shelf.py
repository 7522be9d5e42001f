"""Plans that were learned before, on disk; JSON, so that nothing that is read can run code.

A plan is found again by what it was learned from: the station's view, the request (twin states,
hypotheses, what is delivered, preset, seed) and the code of planner and twin. An attempt repeats to
the bit, so a plan from here is the one that would be learned now: reuse saves time and changes
nothing. What the station is not told (truth, faults, the world's seed) can't be in the key.
"""

import hashlib
import json
import logging
import os
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from base_station import planning, twin
from base_station.planning.requests import PlanReady, PlanRequest, decode, encode
from hil.scenario import StationView

LOG = logging.getLogger("planner")

KEPT = 200  # plans; the oldest go
IRRELEVANT = {"host", "station_sysid", "station_seed", "origin"}  # to a plan; request has a seed
IRRELEVANT_OF_VEHICLES = {"name", "mavlink_port", "connection"}
IRRELEVANT_OF_PLANNING = {"workers", "reuse", "planning_sim_s"}


def default_folder() -> Path:
    """`$XDG_CACHE_HOME/hil-fleet/plans`, by default in `~/.cache`."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "hil-fleet" / "plans"


def key(view: StationView, request: PlanRequest) -> str:
    """What a plan is found by: the same for all that can't make a difference to it."""
    told = view.model_dump(mode="json", exclude=IRRELEVANT)
    for member in told["fleet"]:
        for name in IRRELEVANT_OF_VEHICLES:
            del member[name]
    for name in IRRELEVANT_OF_PLANNING:
        del told["planning"][name]
    asked = encode(replace(request, number=0))
    text = json.dumps([code_version(), told, asked], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


@cache
def code_version() -> str:
    """A hash of the sources that decide what is learned."""
    digest = hashlib.sha256()
    for package in (planning, twin):
        for folder in package.__path__:
            for path in sorted(Path(folder).rglob("*.py")):
                digest.update(path.read_bytes())
    return digest.hexdigest()


@dataclass(frozen=True)
class Shelf:
    """A folder of plans, one file each, named by its key."""

    folder: Path

    def find(self, view: StationView, request: PlanRequest) -> PlanReady | None:
        """The plan that this request got before, marked as reused; None if there is none.

        A file that is damaged is named in the log and counts as none.
        """
        path = self._path(key(view, request))
        try:
            tree = json.loads(path.read_text(encoding="utf-8"))
            found = decode(tree["ready"])
            if tree["sha256"] != _digest(tree["ready"]) or not isinstance(found, PlanReady):
                raise ValueError("its checksum is wrong")
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError) as error:
            LOG.warning("%s: a saved plan that can't be used (%s); learning anew", path, error)
            return None
        return replace(found, number=request.number, reused=True)

    def keep(self, view: StationView, request: PlanRequest, ready: PlanReady) -> None:
        """Save an accepted plan; a disk that is full or read-only is named in the log."""
        if ready.plan is None and ready.policy is None:
            return
        path, text = self._path(key(view, request)), encode(ready)
        part = path.with_suffix(f".{os.getpid()}.part")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            part.write_text(json.dumps({"sha256": _digest(text), "ready": text}), encoding="utf-8")
            part.replace(path)
            self._thin_out()
        except OSError as error:
            LOG.warning("%s: the plan was not saved (%s)", path, error)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.json"

    def _thin_out(self) -> None:
        plans = sorted(self.folder.glob("*.json"), key=lambda p: p.stat().st_mtime)
        for path in plans[:-KEPT]:
            path.unlink(missing_ok=True)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
