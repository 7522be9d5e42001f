"""Faults of a foreign firmware: parameters of its simulator where it has them, else the world's."""

from pathlib import Path
from typing import Any

import pytest

from hil.bench.check import refuse_hopeless
from hil.bench.firmware import breaking, mending
from hil.bench.injector import Breaker
from hil.errors import InputError
from hil.faults import to_injection
from hil.frames import wgs84_to_ned
from hil.mavlink import COMPONENT_AUTOPILOT, Decoder, Encoder, ParamSet, ParamValue
from hil.scenario import FaultModel, Scenario

PATH = Path("s.yaml")


def scenario(autopilot: str, **fault: Any) -> tuple[Scenario, FaultModel]:
    wide = {"north_min_m": -9, "north_max_m": 9, "east_min_m": -9, "east_max_m": 9}
    rover = {
        "name": "rover_1",
        "sysid": 1,
        "airframe": "skid_steer",
        "autopilot": autopilot,
        "start": {"north_m": 0, "east_m": 0},
        "goal": {"north_m": 1, "east_m": 0},
    }
    faults = [{"vehicle": 1, "onset": {"at_s": 60.0}, **fault}]
    tree = {"name": "s", "arena": wide, "yaw": "free", "fleet": [rover], "faults": faults}
    found = Scenario.model_validate(tree)
    return found, found.faults[0]


def test_an_offset_of_the_gps_is_its_glitch_in_degrees() -> None:
    known, fault = scenario("ardupilot", unit="gps", type="offset", size=[3.0, -2.0, 1.0])
    sent = dict(breaking(known, fault).parameters)
    origin = known.origin.origin()
    lat, lon = (sent[f"SIM_GPS_GLITCH_{axis}"] for axis in "XY")
    there = wgs84_to_ned(origin.lat_deg + lat, origin.lon_deg + lon, origin)
    assert there == pytest.approx((3.0, -2.0), abs=1e-6)
    assert sent["SIM_GPS_GLITCH_Z"] == -1.0
    assert not breaking(known, fault).commands
    assert mending(known, fault).parameters == tuple((name, 0.0) for name in sent)


def test_other_faults_that_it_has_a_parameter_for() -> None:
    known, fault = scenario("ardupilot", unit="gps", type="delay", size=[0.5])
    assert breaking(known, fault).parameters == (("SIM_GPS_LAG_MS", 600.0),)
    assert mending(known, fault).parameters == (("SIM_GPS_LAG_MS", 100.0),)
    known, fault = scenario("ardupilot", unit="accel", type="bias", size=[0.1, 0.0, 0.3])
    names = [name for name, _ in breaking(known, fault).parameters]
    assert names == [f"SIM_ACC{i}_BIAS_{axis}" for i in (1, 2) for axis in "ZYX"]


def test_our_own_vehicle_is_broken_as_ever() -> None:
    known, fault = scenario("testbed", unit="gps", type="stuck")
    assert breaking(known, fault) == to_injection(fault.fault())


@pytest.mark.parametrize(
    "fault", [{"unit": "motor", "type": "off"}, {"unit": "gps", "type": "stuck"}]
)
def test_what_it_has_no_parameter_for_is_refused(fault: dict[str, Any]) -> None:
    known, _ = scenario("ardupilot", **fault)
    with pytest.raises(InputError, match=r"faults\.0: rover_1 .*applied_by: world"):
        refuse_hopeless(PATH, known)
    refuse_hopeless(PATH, scenario("ardupilot", **fault, applied_by="world")[0])


def test_it_can_t_be_told_before_it_runs() -> None:
    known, _ = scenario("ardupilot", unit="gps", type="off", onset={"at_s": 0.0})
    with pytest.raises(InputError, match="onset"):
        refuse_hopeless(PATH, known)
    refuse_hopeless(PATH, scenario("ardupilot", unit="gps", type="off")[0])


def test_each_parameter_is_sent_until_it_is_echoed() -> None:
    known, fault = scenario("ardupilot", unit="gps", type="offset", size=[3.0, 0.0, 0.0])
    struck: list[FaultModel] = []
    breaker = Breaker(known, struck.append, struck.append, lambda _: None)
    breaker.strike([fault])
    names, answers = [], list[bytes]()
    for k in range(10):
        sent = breaker.step(float(k), 1, answers)
        (order,) = [r.value for d in sent for r in Decoder().decode(d)] or [None]
        if not isinstance(order, ParamSet):
            break
        names.append(order.name)
        echo = ParamValue(order.name, order.value, 0, 1)
        answers = [] if k == 0 else [Encoder(1, COMPONENT_AUTOPILOT).encode(echo)]
    assert names == [f"SIM_GPS_GLITCH_{axis}" for axis in "ZZYX"]
    assert struck == [fault]
