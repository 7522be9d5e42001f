"""The shell without sockets: ports, errors for people, and the frames of the physics link."""

import argparse
from pathlib import Path

import pytest

from hil.errors import ProcessDiedError
from hil.physics_link import AT_REST_MPS2, PhysicsState, decode_frame, encode_state
from hil.scenario import Scenario
from sim_vehicles.physics_end import PhysicsEnd
from sim_vehicles.process import Ports, main, ports_of

RESCUE = str(Path(__file__).parents[2] / "scenarios" / "rescue.yaml")


def arguments(sysid: int, **given: int) -> argparse.Namespace:
    ports = dict.fromkeys(("physics_port", "mavlink_port", "injector_port"))
    return argparse.Namespace(sysid=sysid, **{**ports, **given})


def reply(time_s: float) -> bytes:
    zero = (0.0, 0.0, 0.0)
    return encode_state(PhysicsState(time_s, zero, AT_REST_MPS2, zero, zero, zero))


def test_ports_follow_the_place_in_the_fleet(rescue: Scenario) -> None:
    assert ports_of(rescue, arguments(3)) == Ports(9022, 14570, 15570)


def test_the_scenario_pins_bases_and_the_command_line_pins_ports(rescue: Scenario) -> None:
    links = rescue.links.model_copy(update={"mavlink_port_base": 20000})
    pinned = rescue.model_copy(update={"links": links})
    assert ports_of(pinned, arguments(2, injector_port=7)) == Ports(9012, 20010, 7)


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        ([RESCUE, "--sysid", "9"], "--sysid 9 is not in the fleet; it has [1, 2, 3]"),
        (["nowhere.yaml", "--sysid", "1"], "nowhere.yaml: cannot be read"),
        ([RESCUE, "--sysid", "1", "--set", "seed=-1"], "seed = -1"),
        ([RESCUE, "--sysid", "1", "--host", "no such host"], "--host no such host"),
        ([RESCUE, "--sysid", "1", "--physics-port", "70000"], "a port is 1 to 65535"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    argv: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_info:
        main(argv)
    assert exit_info.value.code == 2
    out, err = capsys.readouterr()
    assert words in err
    assert "Traceback" not in err
    assert out == ""


def test_frames_count_up_with_each_reply_and_repeat_without() -> None:
    end = PhysicsEnd(50)
    counts = []
    for time_s in (0.02, None, 0.04, 0.04, 0.06):
        frame = decode_frame(end.frame((1500,)))
        assert frame is not None
        assert frame.pwm_us == (1500, *(0,) * 15)
        counts.append(frame.frame_count)
        end.accept([reply(time_s)] if time_s else [b"garbage"])
    assert counts == [0, 1, 1, 2, 2]


def test_a_world_that_starts_again_ends_the_vehicle() -> None:
    end = PhysicsEnd(50)
    end.accept([reply(10.0)])
    assert end.accept([reply(9.5)]) is None
    with pytest.raises(ProcessDiedError, match=r"went back from 10.00 to 0.02 s"):
        end.accept([reply(0.02)])
