"""Adapters: what each autopilot is told, and that nobody else knows its name."""

import io
import tokenize
from dataclasses import replace
from pathlib import Path

import pytest

from base_station.autopilots import NAMES, adapter
from base_station.receiving.telemetry import Status
from hil.airframe import OMNI_PLUS, QUAD_X, SKID_STEER
from hil.errors import InputError
from hil.mavlink import (
    COMPONENT_GCS,
    Command,
    CommandLong,
    Decoder,
    EkfFlag,
    Encoder,
    LocalSetpoint,
    Message,
    ParamSet,
    ParamType,
    ParamValue,
)

ROOT = Path(__file__).parents[2]


def said(datagram: bytes) -> Message:
    (received,) = Decoder().decode(datagram)
    assert isinstance(received.value, Message)
    return received.value


def encoder() -> Encoder:
    return Encoder(250, COMPONENT_GCS)


def names_in(path: Path) -> set[str]:
    """Names of autopilots in the code of a file; comments and docstrings may tell of them."""
    found = set()
    before = tokenize.NEWLINE
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline)
    for token in tokens:
        is_docstring = token.type == tokenize.STRING and before in (
            tokenize.NEWLINE,
            tokenize.INDENT,
        )
        if token.type in (tokenize.NAME, tokenize.STRING) and not is_docstring:
            found |= {n for n in NAMES if n != "testbed" and n in token.string.lower()}
        if token.type not in (tokenize.NL, tokenize.COMMENT):
            before = token.type
    return found


def test_no_autopilot_is_named_outside_its_adapter() -> None:
    told = {
        str(path.relative_to(ROOT)): names
        for package in ("base_station", "hil/scenario", "hil/world")
        for path in sorted((ROOT / package).rglob("*.py"))
        if path.parent.name != "autopilots" and (names := names_in(path))
    }
    assert told == {}


def test_the_search_for_names_finds_one(tmp_path: Path) -> None:
    path = tmp_path / "guilty.py"
    path.write_text('"""ArduPilot may be told of."""\nKIND = "px4"  # ardupilot, too\n')
    assert names_in(path) == {"px4"}


def test_an_unknown_autopilot_is_refused_in_one_line() -> None:
    with pytest.raises(InputError, match=r"autopilot = 'betaflight'.*testbed, ardupilot, px4"):
        adapter("betaflight", OMNI_PLUS)


@pytest.mark.parametrize("name", NAMES)
def test_the_mode_that_is_asked_for_is_told_from_the_others(name: str) -> None:
    autopilot = adapter(name, OMNI_PLUS)
    for mode in (autopilot.driven_mode, autopilot.hold_mode):
        command = said(autopilot.set_mode(encoder(), 3, mode))
        assert isinstance(command, CommandLong)
        assert (command.target_sysid, command.command) == (3, Command.DO_SET_MODE)
        assert autopilot.drives(command) == (mode == autopilot.driven_mode)


def test_px4_modes_travel_as_main_and_sub_mode() -> None:
    px4 = adapter("px4", OMNI_PLUS)
    hold = said(px4.set_mode(encoder(), 1, px4.hold_mode))
    assert isinstance(hold, CommandLong)
    assert hold.params[:3] == (1.0, 4.0, 3.0)  # custom, AUTO, LOITER
    driven = said(px4.set_mode(encoder(), 1, px4.driven_mode))
    assert isinstance(driven, CommandLong)
    assert driven.params[:3] == (1.0, 6.0, 0.0)  # custom, OFFBOARD


def test_px4_integers_travel_as_their_bytes() -> None:
    px4 = adapter("px4", OMNI_PLUS)
    told = said(px4.set_parameter(encoder(), 1, "NAV_DLL_ACT", 1.0))
    assert isinstance(told, ParamSet)
    assert told.param_type == ParamType.INT32
    assert told.value == pytest.approx(1.4e-45)
    echo = ParamValue("NAV_DLL_ACT", told.value, 12, 900, ParamType.INT32)
    assert px4.parameter(echo) == 1.0


@pytest.mark.parametrize(
    ("name", "yaw_rad", "mask"),
    [("testbed", None, 3527), ("ardupilot", None, 3527), ("ardupilot", 0.5, 2503)],
)
def test_type_masks(name: str, yaw_rad: float | None, mask: int) -> None:
    drive = adapter(name, OMNI_PLUS).velocity(encoder(), 1, 2.0, 0.3, -0.1, yaw_rad)
    setpoint = said(drive)
    assert isinstance(setpoint, LocalSetpoint)
    assert setpoint.type_mask == mask


@pytest.mark.parametrize(("speed_mps", "mask"), [(0.0, 1479), (0.3, 3527)])
def test_told_to_stand_ardupilot_is_not_told_to_face_north(speed_mps: float, mask: int) -> None:
    stand = said(adapter("ardupilot", SKID_STEER).velocity(encoder(), 1, 2.0, speed_mps, 0.0, None))
    assert isinstance(stand, LocalSetpoint)
    assert stand.type_mask == mask
    assert stand.yaw_rate_radps == (0.0 if speed_mps == 0.0 else None)


def test_ardupilot_is_ready_when_its_ekf_has_a_position() -> None:
    ardupilot = adapter("ardupilot", OMNI_PLUS)
    located = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_HORIZ | EkfFlag.POS_HORIZ_ABS
    ready = Status(prearm_ok=True, ekf_flags=int(located))
    assert ardupilot.ready(ready)
    assert not ardupilot.ready(replace(ready, prearm_ok=False))
    assert not ardupilot.ready(replace(ready, ekf_flags=int(located | EkfFlag.CONST_POS_MODE)))
    assert not ardupilot.ready(replace(ready, ekf_flags=int(EkfFlag.ATTITUDE)))


def test_what_rolls_under_ardupilot_goes_nose_first_and_what_flies_does_not() -> None:
    assert adapter("ardupilot", OMNI_PLUS).heading_first
    assert not adapter("ardupilot", QUAD_X).heading_first
    assert not adapter("testbed", OMNI_PLUS).heading_first
