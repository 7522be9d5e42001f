"""From a campaign to its runs: which there are, and what exactly each of them is (pure)."""

import hashlib
import itertools
import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import hil
from hil.bench.campaign.draws import draw_layout, drawn
from hil.bench.campaign.file import HOW_KEYS, Campaign, How, Overrides
from hil.bench.campaign.planners import MISSIONS, saved_policy
from hil.errors import InputError
from hil.scenario import Scenario
from hil.scenario.loading import put, read_map, validated

Point = dict[str, str]  # axis: name of the point


@dataclass(frozen=True)
class RunSpec:
    """One run, whole: nothing else decides what comes out, but `code`.

    `tree` is the scenario as plain values, `code` a digest of the program that runs it.
    """

    campaign: str
    split: str
    point: Point
    layout: int
    repeat: int
    how: How
    tree: dict[str, Any]
    policy: str  # a saved policy as text; empty when the mission needs none
    code: str

    @cached_property
    def key(self) -> str:
        """Content hash."""
        told = {**vars(self), "how": self.how.model_dump(mode="json")}
        canonical = json.dumps(told, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(canonical.encode()).hexdigest()[:32]

    def scenario(self) -> Scenario:
        return Scenario.model_validate(self.tree)


def runs(path: Path, campaign: Campaign, code: str) -> list[RunSpec]:
    """All runs of the campaign read from `path`, checked. Raises InputError."""
    combinations = [
        dict(zip(campaign.grid, names, strict=True))
        for names in itertools.product(*campaign.grid.values())
    ]
    places = itertools.product(range(campaign.layout_count), range(campaign.repeats))
    files = _Files(path.parent)
    if campaign.combine == "cross":
        which = [(point, *place) for place in places for point in combinations]
    else:
        which = [(combinations[k % len(combinations)], *place) for k, place in enumerate(places)]
    return [_run(path, campaign, files, code, *w) for w in which]


class _Files:
    """Scenarios and policies, read once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._texts: dict[str, str] = {}

    def tree(self, name: str) -> dict[str, Any]:
        if name not in self._texts:
            self._texts[name] = json.dumps(read_map(self._folder / name))
        tree: dict[str, Any] = json.loads(self._texts[name])
        return tree

    def policy(self, mission: str) -> str:
        """Checked; empty for a mission that needs no file. Raises InputError."""
        if mission in MISSIONS:
            return ""
        if mission not in self._texts:
            try:
                text = (self._folder / mission).read_text(encoding="utf-8")
                saved_policy(text)
            except (OSError, ValueError, KeyError, TypeError) as error:
                raise InputError(
                    f"mission = {mission!r}: cannot be read ({error}); it must be one of "
                    f"{', '.join(MISSIONS)}, or a file with a line of a planner's answer"
                ) from None
            self._texts[mission] = text
        return self._texts[mission]


def _run(
    path: Path,
    campaign: Campaign,
    files: _Files,
    code: str,
    point: Point,
    layout: int,
    repeat: int,
) -> RunSpec:
    seed = campaign.seed(layout, repeat)
    sets = [("random", campaign.random)]
    sets += [(f"grid.{a}.{n}", campaign.grid[a][n]) for a, n in point.items()]
    try:
        chosen = {
            key: (where, drawn(value, seed, key))
            for where, overrides in sets
            for key, value in overrides.items()
        }
        how = _how(campaign, {k: v for k, (_, v) in chosen.items() if k in HOW_KEYS}, path)
        policy = files.policy(how.mission)
        name = chosen.get("scenario", ("", campaign.scenario))[1]
        tree = _tree(files.tree(name), chosen, how)
        scenario = _placed(tree, campaign, layout, seed)
    except InputError as error:
        told = str(error).removeprefix(f"{path}: ")
        raise InputError(f"{path}: {_named(point)}: {told}") from None
    return RunSpec(
        campaign=campaign.name,
        split=campaign.split,
        point=point,
        layout=campaign.layout_number(layout),
        repeat=repeat,
        how=how,
        tree=scenario.model_dump(mode="json"),
        policy=policy,
        code=code,
    )


def _how(campaign: Campaign, changes: Overrides, path: Path) -> How:
    own = {key: getattr(campaign, key) for key in HOW_KEYS}
    return validated(How, path, own | changes)


def _tree(tree: dict[str, Any], chosen: dict[str, tuple[str, Any]], how: How) -> dict[str, Any]:
    if how.planner not in ("still", "passive"):
        put(tree, "planning.planner", how.planner, "planner")
    for key, (where, value) in chosen.items():
        if key in HOW_KEYS or key == "scenario":
            continue
        put(tree, key, value, f"{where}.{key}")
    return tree


def _placed(tree: dict[str, Any], campaign: Campaign, layout: int, seed: int) -> Scenario:
    tree["seed"] = seed
    scenario = validated(Scenario, Path("scenario"), tree)
    if campaign.layouts is None:
        return scenario
    number = campaign.layout_number(layout)
    places = draw_layout(number, campaign.layouts, scenario.arena, scenario.fleet)
    whole = scenario.model_dump(mode="json")
    for vehicle, (start, goal) in zip(whole["fleet"], places, strict=True):
        vehicle["start"] = {"north_m": start[0], "east_m": start[1]}
        vehicle["goal"] = {"north_m": goal[0], "east_m": goal[1]}
    return validated(Scenario, Path("scenario"), whole)


def _named(point: Point) -> str:
    return ", ".join(f"{axis} {name}" for axis, name in point.items()) or "the only run"


def code_digest() -> str:
    """Of the program, reports excepted: runs of different programs are different runs."""
    root, digest = Path(hil.__file__).parents[1], hashlib.sha256()
    for package in ("hil", "base_station", "sim_vehicles"):
        for file in sorted((root / package).rglob("*.py")):
            if "report" not in file.relative_to(root).parts:
                digest.update(str(file.relative_to(root)).encode() + file.read_bytes())
    return digest.hexdigest()[:16]
