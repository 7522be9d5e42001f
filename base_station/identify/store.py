"""Fits as a YAML file beside the fleet file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from base_station.identify.session import VehicleFit
from hil.errors import InputError
from hil.scenario import StationView

DIGITS = 5


def tree_of(view: StationView, fits: Sequence[VehicleFit]) -> dict[str, Any]:
    """Plain values, by the vehicle's name."""
    names = {m.sysid: m.name for m in view.fleet}
    return {"identified": {names[f.sysid]: _vehicle(f) for f in fits}}


def write_fits(path: Path, view: StationView, fits: Sequence[VehicleFit]) -> None:
    """Raises InputError when it can't be written."""
    text = yaml.safe_dump(tree_of(view, fits), sort_keys=False)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def _vehicle(fit: VehicleFit) -> dict[str, Any]:
    tree: dict[str, Any] = {"sysid": fit.sysid, "axes": {}}
    for name, axis in fit.axes.items():
        tree["axes"][name] = {
            "model": axis.model,
            "time_constant_s": round(axis.derived.time_constant_s, DIGITS),
            "speed_gain": round(axis.derived.speed_gain, DIGITS),
            "latency_s": round(axis.derived.latency_s, DIGITS),
            "link_s": round(max(0.0, axis.link_s), DIGITS),
            "parameters": [round(x, DIGITS) for x in axis.parameters],
            "residual_mps": round(axis.residual_mps, DIGITS),
            "residual_m": round(axis.residual_m, DIGITS),
            "nominal_residual_m": round(axis.nominal_residual_m, DIGITS),
        }
    if fit.noise is not None:
        tree["noise"] = {
            "gps_position_sigma_m": round(fit.noise.gps_position_sigma_m, DIGITS),
            "gps_velocity_sigma_mps": round(fit.noise.gps_velocity_sigma_mps, DIGITS),
            "fixes": fit.noise.fixes,
        }
    return tree
