"""`hil check`: margins, and rescues that cannot work."""

import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from bench_builders import RESCUE, rescue

from hil.airframe import OMNI_PLUS, push_margin
from hil.bench.check import describe, margin, refuse_hopeless
from hil.cli import main
from hil.errors import InputError
from hil.scenario import MIN_PUSH_MARGIN, Scenario


def alone(**changes: object) -> Scenario:
    """Rover 2 of the rescue with nobody to push it."""
    tree = rescue().model_dump()
    tree["fleet"] = [tree["fleet"][1]]
    tree["expect"] = {"goals": {2: ["reached"]}}
    return Scenario.model_validate(tree | changes)


def test_the_margin_adds_up_over_the_pushers() -> None:
    scenario = rescue()
    pushed = scenario.vehicle(2)
    assert margin(scenario, pushed, "y") == pytest.approx(push_margin(OMNI_PLUS, 2, OMNI_PLUS))
    assert margin(scenario, pushed, "y") >= MIN_PUSH_MARGIN


def test_fleet_faults_and_margins_are_shown() -> None:
    text = describe(rescue())
    for words in ("rover_2: motor 3, 4 off, at 0 s", "push margin", "body y", "omni_plus"):
        assert words in text


def test_faults_are_told_with_their_sizes() -> None:
    weak = {"vehicle": 2, "unit": "motor", "type": "partial", "instances": [1], "size": 0.5}
    jump = {"vehicle": 1, "unit": "gps", "type": "offset", "size": [3.0, -2.0, 0.0]}
    text = describe(Scenario.model_validate(rescue().model_dump() | {"faults": [weak, jump]}))
    assert "rover_2: motor 1 partial 0.5," in text
    assert "rover_1: gps all offset 3, -2, 0," in text


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_rescue_nobody_can_give_is_refused(
    command: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "alone.yaml"
    path.write_text(yaml.safe_dump(alone().model_dump(mode="json", exclude_none=True)))
    assert main([command, str(path)]) == 2
    line = capsys.readouterr().err
    assert "rover_2 cannot be rescued: the push margin along body y is 0.00" in line
    assert line.count("\n") == 1
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "scenario",
    [
        alone(yaw="free"),
        alone(expect={}),
        alone(expect={"goals": {2: ["uncertain", "unreached"]}}),
        alone(faults=[{"vehicle": 2, "unit": "motor", "type": "off", "instances": [3]}]),
        alone(faults=[{"vehicle": 2, "unit": "motor", "type": "partial", "size": 0.9}]),
        alone(faults=[{"vehicle": 2, "unit": "gps", "type": "stuck"}]),
    ],
    ids=["can turn", "no expectation", "not expected", "half a pair", "weak", "gps"],
)
def test_what_is_no_rescue_passes(scenario: Scenario) -> None:
    refuse_hopeless(Path("x.yaml"), scenario)


def test_a_hypothesis_nobody_has_is_refused() -> None:
    with pytest.raises(InputError, match=r"expect.hypothesis = 'motor_z_off': .* motor_y_off"):
        refuse_hopeless(Path("x.yaml"), rescue("expect.hypothesis=motor_z_off"))


def test_an_unreadable_onset_is_refused() -> None:
    fault = {"vehicle": 2, "unit": "motor", "type": "off", "onset": {"when": "rover_2.north_m > ."}}
    tree = rescue().model_dump() | {"faults": [fault]}
    with pytest.raises(InputError, match=r"onset\.when"):
        describe(Scenario.model_validate(tree))


def test_an_early_interrupt_is_no_traceback(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("hil.cli.load_scenario", interrupted)
    assert main(["run", str(RESCUE)]) == 128 + 2
    assert capsys.readouterr().err == "hil: interrupted\n"


def test_the_command_line_imports_nothing_heavy() -> None:
    code = (
        "import sys; from hil.cli import main; code = main(['check', sys.argv[1]]); "
        "heavy = {'torch', 'stable_baselines3', 'rerun', 'pymunk', 'numba'} & set(sys.modules); "
        "sys.exit(f'imported {heavy}' if heavy else code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(RESCUE)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_an_autopilot_nobody_has_an_adapter_for_is_refused() -> None:
    with pytest.raises(InputError, match=r"fleet\.1\.autopilot = 'betaflight'"):
        refuse_hopeless(Path("x.yaml"), rescue("fleet.1.autopilot=betaflight"))
