"""Scenario files: safe YAML, overrides, and messages for people."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import ValidationError

from hil.errors import InputError
from hil.scenario.fields import Model
from hil.scenario.fleetfile import FleetFile, Found, FoundVehicle, is_fleet_file
from hil.scenario.schema import Scenario
from hil.scenario.station import StationView

MAX_FILE_BYTES = 1_000_000
MAX_SHOWN = 80  # characters of a wrong value in a message


M = TypeVar("M", bound=Model)


def load_scenario(path: Path, overrides: Sequence[str] = ()) -> Scenario:
    """Read a scenario, with what `hil identify` wrote of its vehicles where that lies beside it.

    `overrides` are `key.path=value` as given to `--set`. Raises InputError.
    """
    tree = read_map(path)
    for override in overrides:
        apply_override(tree, override)
    scenario = validated(Scenario, path, tree)
    found = _found_beside(path, {v.name: v.sysid for v in scenario.fleet})
    fleet = [
        v.model_copy(update={"identified": found[v.name].axes}) if v.name in found else v
        for v in scenario.fleet
    ]
    return scenario.model_copy(update={"fleet": tuple(fleet)}) if found else scenario


def load_station_view(path: Path) -> StationView:
    """Read a station view, or a fleet file as one, with what `hil identify` wrote beside it.

    Raises InputError.
    """
    tree = read_map(path)
    if is_fleet_file(tree):
        fleet = validated(FleetFile, path, tree)
        return fleet.view(_found_beside(path, {v.name: v.sysid for v in fleet.fleet}))
    return validated(StationView, path, tree)


def _found_beside(path: Path, sysids: Mapping[str, int]) -> dict[str, FoundVehicle]:
    """What `hil identify` wrote beside a file, by the vehicles' names. Raises InputError."""
    beside = path.with_suffix(".identified.yaml")
    if not beside.exists():
        return {}
    found = validated(Found, beside, read_map(beside)).identified
    for name, vehicle in found.items():
        if sysids.get(name) != vehicle.sysid:
            raise InputError(
                f"{beside}: identified.{name}.sysid = {vehicle.sysid}: no such vehicle here; "
                "run hil identify again, or remove the file"
            )
    return found


def validated(model: type[M], path: Path, tree: dict[str, Any]) -> M:
    """A tree that came from `path` as a model. Raises InputError."""
    try:
        return model.model_validate(tree)
    except ValidationError as error:
        raise InputError(f"{path}: {_one_line(error)}") from None


def _one_line(error: ValidationError) -> str:
    first, *rest = error.errors()
    where = ".".join(str(part) for part in first["loc"]) or "scenario"
    message = first["msg"].removeprefix("Value error, ")
    value = first.get("input")
    shown = "" if isinstance(value, dict | list | tuple | Model) else f" = {_short(repr(value))}"
    remedy = {
        "extra_forbidden": "; remove it, or see `hil schema` for the keys there are",
        "missing": "; add it, see `hil schema`",
    }.get(first["type"], "")
    more = f" (and {len(rest)} more)" if rest else ""
    return f"{where}{shown}: {message[0].lower()}{message[1:]}{remedy}{more}"


def _short(text: str) -> str:
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


class _StrictLoader(yaml.SafeLoader):
    """Safe YAML that also refuses a key given twice, and aliases (they can grow without bound)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases (*name) are not allowed")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        keys = [key.value for key, _ in node.value]
        for key in keys:
            if keys.count(key) > 1:
                raise yaml.YAMLError(
                    f"key {key!r} is given twice (line {node.start_mark.line + 1})"
                )
        return super().construct_mapping(node, deep)


def read_map(path: Path) -> dict[str, Any]:
    """The keys and values of a YAML file. Raises InputError."""
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}; check the path") from None
    if len(raw) > MAX_FILE_BYTES:
        raise InputError(f"{path}: {len(raw)} bytes; the limit is {MAX_FILE_BYTES}")
    try:
        tree = yaml.load(raw.decode("utf-8"), _StrictLoader)  # a SafeLoader
    except UnicodeDecodeError:
        raise InputError(f"{path}: not UTF-8 text; a scenario is a YAML file") from None
    except RecursionError:
        raise InputError(f"{path}: not valid YAML: nested too deeply") from None
    except (yaml.YAMLError, ValueError) as error:  # a date or number that cannot be is a ValueError
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    if not isinstance(tree, dict):
        kind = {type(None): "empty", list: "a list"}.get(type(tree), "a single value")
        raise InputError(f"{path}: is {kind}; a map of keys is needed, see `hil schema`")
    return tree


def apply_override(tree: dict[str, Any], override: str) -> None:
    """Change one value of a tree, as `--set key.path=value` does. Raises InputError."""
    key_path, equals, text = override.partition("=")
    if not equals or not key_path:
        raise InputError(f"--set {override}: must be key.path=value, as in --set seed=3")
    try:
        value = yaml.load(text, _StrictLoader)  # a SafeLoader
    except (yaml.YAMLError, ValueError, RecursionError):
        raise InputError(f"--set {_short(override)}: the value is not valid YAML") from None
    put(tree, key_path, value, f"--set {override}")


def put(tree: dict[str, Any], key_path: str, value: Any, told: str) -> None:
    """Change one value of a tree in place. Raises InputError, which begins with `told`."""
    *parents, last = key_path.split(".")
    node: Any = tree
    for key in parents:
        node = _child(node, key, told)
    if isinstance(node, dict):
        node[last] = value
    else:
        _child(node, last, told)
        node[int(last)] = value


def _child(node: Any, key: str, told: str) -> Any:
    if isinstance(node, list):
        if key.isdecimal() and int(key) < len(node):
            return node[int(key)]
        raise InputError(f"{told}: {key} is not an index below {len(node)}")
    if isinstance(node, dict):
        return node.setdefault(key, {})
    raise InputError(f"{told}: {key} is inside a plain value")
