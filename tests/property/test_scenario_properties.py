"""Scenario files: valid ones survive writing and reading; no text whatever makes a traceback."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hil.errors import InputError
from hil.scenario import Scenario, load_scenario

COORDINATE = st.floats(-9.0, 9.0).map(lambda x: round(x, 3))
POINTS = st.fixed_dictionaries({"north_m": COORDINATE, "east_m": COORDINATE})
SCALARS = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
TREES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner),
    max_leaves=8,
)
KEYS = st.sampled_from([*Scenario.model_fields, "colour"])


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("scenarios") / "any.yaml"


@st.composite
def scenarios(draw: st.DrawFn) -> Scenario:
    """Rovers on a line, far enough apart, with any goals."""
    count = draw(st.integers(1, 5))
    sysids = draw(st.lists(st.integers(1, 249), min_size=count, max_size=count, unique=True))
    fleet = [
        {
            "name": f"rover_{sysid}",
            "sysid": sysid,
            "start": {"north_m": draw(COORDINATE), "east_m": float(3 * i - 6)},
            "start_yaw_deg": draw(st.floats(-180, 180)),
            "goal": draw(POINTS),
        }
        for i, sysid in enumerate(sysids)
    ]
    arena = {"north_min_m": -10, "north_max_m": 10, "east_min_m": -10, "east_max_m": 10}
    onset = draw(st.floats(0, 100).map(lambda t: {"at_s": t}))
    fault = {"vehicle": draw(st.sampled_from(sysids)), "unit": "motor", "type": "off"}
    return Scenario.model_validate(
        {
            "name": "drawn",
            "seed": draw(st.integers(0, 2**31 - 1)),
            "arena": arena,
            "yaw": draw(st.sampled_from(["locked", "free"])),
            "fleet": fleet,
            "faults": [{**fault, "onset": onset}],
            "expect": {"goals": {sysids[0]: ["reached", "uncertain"]}},
        }
    )


@given(scenarios())
def test_what_hil_run_hands_on_is_what_it_read(path: Path, scenario: Scenario) -> None:
    path.write_text(yaml.safe_dump(scenario.model_dump(mode="json", exclude_none=True)))
    assert load_scenario(path) == scenario


@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_bytes_are_refused_in_one_line(path: Path, raw: bytes) -> None:
    path.write_bytes(raw)
    with pytest.raises(InputError) as refusal:
        load_scenario(path)
    assert "\n" not in str(refusal.value)


@given(st.dictionaries(KEYS, TREES, max_size=6))
def test_any_map_is_refused_in_one_line(path: Path, tree: dict[str, object]) -> None:
    path.write_text(yaml.safe_dump(tree))
    with pytest.raises(InputError) as refusal:
        load_scenario(path)
    assert "\n" not in str(refusal.value)
