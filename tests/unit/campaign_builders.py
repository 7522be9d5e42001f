"""What the tests of campaigns start from."""

from pathlib import Path
from typing import Any

import yaml

from hil.bench.campaign.file import Campaign, load_campaign
from hil.bench.campaign.plan import RunSpec, runs
from hil.bench.campaign.row import Row

ROOT = Path(__file__).parents[2]
RESCUE = str(ROOT / "scenarios" / "rescue.yaml")
CODE = "0123"


def write(folder: Path, **changes: Any) -> Path:
    """A small campaign's file; None takes a key away."""
    tree: dict[str, Any] = {
        "name": "small",
        "scenario": RESCUE,
        "layouts": {"count": 2},
        "grid": {"fault": {"none": {"faults": []}, "motor_y_off": {}}},
    }
    path = folder / "campaign.yaml"
    path.write_text(
        yaml.safe_dump(
            {k: v for k, v in (tree | changes).items() if v is not None}, sort_keys=False
        )
    )
    return path


def planned(folder: Path, **changes: Any) -> tuple[Campaign, list[RunSpec]]:
    path = write(folder, **changes)
    campaign = load_campaign(path)
    return campaign, runs(path, campaign, CODE)


def row(**changes: Any) -> Row:
    """A broken motor, found."""
    found: dict[str, Any] = {
        "key": "k",
        "point": {"fault": "motor_y_off"},
        "layout": 0,
        "repeat": 0,
        "seed": 0,
        "meant": "motor_y_off",
        "truth": "motor_y_off",
        "suspect": 2,
        "suspect_truth": "motor_y_off",
        "hypothesis": "motor_y_off",
        "decided": True,
        "posterior": {"motor_y_off": 0.99, "none": 0.01},
        "prior": {"motor_y_off": 0.5, "none": 0.5},
        "looks": {"2": {"motor_y_off": 0.7, "none": 0.3}},
        "onset_s": 5.0,
        "alarm_s": 6.5,
        "verdict_s": 16.5,
        "healthy_vehicle_s": 45.0,
        "vehicle_s": 60.0,
        "fleet_s": 20.0,
        "contacts": 1,
        "contact_max_ns": 3.0,
        "contact_sum_ns": 3.0,
        "cpu_s": 1.0,
    }
    return Row(**(found | changes))


def healthy(**changes: Any) -> Row:
    """Nothing was wrong, and nothing was said."""
    quiet: dict[str, Any] = {
        "meant": "none",
        "truth": "none",
        "suspect": None,
        "suspect_truth": "none",
        "hypothesis": None,
        "decided": False,
        "posterior": {},
        "prior": {},
        "looks": {},
        "onset_s": None,
        "alarm_s": None,
        "verdict_s": None,
        "contacts": 0,
        "contact_max_ns": 0.0,
        "contact_sum_ns": 0.0,
    }
    return row(**(quiet | changes))
