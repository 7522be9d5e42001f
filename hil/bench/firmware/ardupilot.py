"""ArduPilot's rover in our world: `ardurover --model JSON:...`, a fresh folder for each.

Environment variable ARDUROVER names the binary. What it is not told by option it reads from a
file of parameters: skid steering on outputs 1 and 2, no power when disarmed, and gains for the
airframe (from its motors' torque-speed line, as ArduPilot's tuning guide asks).
"""

import os
from collections.abc import Sequence
from pathlib import Path

from hil.airframe import Airframe
from hil.bench.processes import Command
from hil.errors import InputError
from hil.faults import Fault, Type, Unit
from hil.frames import Origin, ned_to_wgs84
from hil.scenario import PORTS_PER_VEHICLE, Scenario, Vehicle

NAME = "ardupilot"
BINARY = "ARDUROVER"
AIRFRAMES = ("skid_steer",)
OTHER_LINES = (2, 5, 6, 7)  # 3 and 4 are its GPS receivers
CRUISE_SHARE = 0.7  # of the speed limit, where throttle is calibrated
LAG_S = 0.1  # SIM_GPS_LAG_MS as it is
IMUS = (1, 2)


def binary() -> Path | None:
    """The rover's simulator, if there is one."""
    named = os.environ.get(BINARY)
    return Path(named) if named and os.access(named, os.X_OK) else None


def start(scenario: Scenario, vehicle: Vehicle, folder: Path) -> Command:
    """Raises InputError when there is no binary, or it can't be that airframe."""
    program = binary()
    if program is None:
        raise InputError(
            f"{vehicle.name}: autopilot {NAME} needs environment variable {BINARY} to name an "
            "ardurover built for SITL"
        )
    if vehicle.airframe not in AIRFRAMES:
        raise InputError(
            f"{vehicle.name}: ArduPilot's rover drives heading first; airframe must be one of "
            f"{', '.join(AIRFRAMES)}, not {vehicle.airframe}"
        )
    links, index = scenario.links, scenario.fleet.index(vehicle)
    assert links.physics_port_base is not None
    assert links.mavlink_port_base is not None
    assert links.injector_port_base is not None
    home = folder / vehicle.name
    home.mkdir()
    (home / "rover.parm").write_text(parameters(scenario, vehicle), encoding="utf-8")
    origin = scenario.origin
    offset = PORTS_PER_VEHICLE * index
    argv = (
        str(program.resolve()),
        *("--model", f"JSON:{links.host}"),
        *("--sim-port-out", str(links.physics_port_base + offset)),
        *("--home", f"{origin.lat_deg:.7f},{origin.lon_deg:.7f},{origin.alt_m:g},0"),
        *("--serial0", f"udpclient:{links.host}:{links.mavlink_port_base + offset}"),
        *("--serial1", f"udpclient:{links.host}:{links.injector_port_base + offset}"),
        *(word for i in OTHER_LINES for word in (f"--serial{i}", "none:x")),
        *("--sysid", str(vehicle.sysid), "--speedup", "1", "--defaults", "rover.parm", "--wipe"),
    )
    log = folder / f"{vehicle.name}.log"
    return Command(f"ardurover {vehicle.name}", argv, log, cwd=home, says_ready=False)


def parameters(scenario: Scenario, vehicle: Vehicle) -> str:
    """The file of defaults, one `NAME value` a line."""
    frame = vehicle.frame
    cruise_mps = CRUISE_SHARE * frame.speed_limit_mps
    values = {
        "SYSID_THISMAV": vehicle.sysid,
        "SYSID_MYGCS": scenario.links.station_sysid,
        "FRAME_CLASS": 1,
        "SERVO1_FUNCTION": 73,  # throttle left
        "SERVO2_FUNCTION": 74,  # throttle right
        "SERVO3_FUNCTION": 0,
        "MOT_SAFE_DISARM": 1,  # no pulses: wheels run free
        "SIM_RATE_HZ": scenario.clock.physics_hz,
        "SIM_SPEEDUP": 1,
        "INITIAL_MODE": 4,  # HOLD
        "LOG_BACKEND_TYPE": 0,
        "ARMING_RUDDER": 0,
        "CRUISE_SPEED": cruise_mps,
        "CRUISE_THROTTLE": round(100 * _throttle_for(frame, cruise_mps)),
        "WP_SPEED": frame.speed_limit_mps,
        "ATC_STR_RAT_FF": 0.25,
        "ATC_STR_RAT_P": 0.2,
        "ATC_STR_RAT_I": 0.2,
        "ATC_STR_ANG_P": 2.0,
        "ATC_STR_RAT_MAX": 120,
        "ATC_SPEED_P": 0.3,
        "ATC_SPEED_I": 0.3,
        "ATC_ACCEL_MAX": 2.0,
    }
    return "".join(f"{name} {value:g}\n" for name, value in values.items())


def broken(fault: Fault, lat_deg: float) -> tuple[tuple[str, float], ...] | None:
    """SIM_* parameters that make a fault happen, near a latitude; None where it has none.

    By the names of version 4.5 and 4.6-dev. Of motors it has none that would do: SIM_ENGINE_MUL
    scales the pulse above 1000 us, which on a motor with its zero at 1500 us is another fault.
    SIM_GPS_NOISE is noise of the altitude. A receiver that is off moves all that it says.
    """
    match fault.unit, fault.type:
        case Unit.GPS, Type.OFF:
            return (("SIM_GPS_DISABLE", 1.0),)
        case Unit.GPS, Type.DELAY:
            return (("SIM_GPS_LAG_MS", 1000.0 * (LAG_S + fault.size[0])),)
        case Unit.GPS, Type.OFFSET:
            north_m, east_m, down_m = fault.size
            lat, lon = ned_to_wgs84(north_m, east_m, Origin(lat_deg, 0.0, 0.0))
            return _vector("SIM_GPS_GLITCH", (lat - lat_deg, lon, -down_m))
        case ((Unit.ACCEL | Unit.GYRO), Type.BIAS):
            name = "ACC" if fault.unit is Unit.ACCEL else "GYR"
            return tuple(
                parameter
                for imu in fault.instances or IMUS
                for parameter in _vector(f"SIM_{name}{imu}_BIAS", fault.size)
            )
    return None


def mended(fault: Fault, lat_deg: float) -> tuple[tuple[str, float], ...] | None:
    """The same parameters as they were."""
    names = [name for name, _ in broken(fault, lat_deg) or ()]
    return tuple((name, 1000.0 * LAG_S if name.endswith("LAG_MS") else 0.0) for name in names)


def _vector(prefix: str, values: Sequence[float]) -> tuple[tuple[str, float], ...]:
    """X last: it is echoed together with the others, as they are then."""
    return tuple((f"{prefix}_{axis}", v) for axis, v in zip("ZYX", values[::-1], strict=True))


def _throttle_for(frame: Airframe, speed_mps: float) -> float:
    """Output that holds a speed: the motors' speed line, and rolling resistance."""
    free_mps = sum(m.free_speed_mps for m in frame.motors) / len(frame.motors)
    return speed_mps / free_mps + frame.rolling_force_n / frame.axis_stall_force_n("x")
