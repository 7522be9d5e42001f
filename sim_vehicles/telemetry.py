"""Telemetry: a snapshot of the vehicle to messages (pure)."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum

from hil.airframe import Airframe, pwm_to_output
from hil.frames import Origin, ned_to_wgs84
from hil.mavlink import (
    AUTOPILOT_ARDUPILOT,
    MODE_FLAG_CUSTOM,
    MODE_FLAG_GUIDED,
    MODE_FLAG_MANUAL,
    TYPE_QUADROTOR,
    TYPE_ROVER,
    Attitude,
    AutopilotVersion,
    Battery,
    Capability,
    EkfFlag,
    EkfStatus,
    EscTelemetry,
    ExtendedSysState,
    FenceStatus,
    FixType,
    GlobalPosition,
    GpsOrigin,
    GpsRaw,
    Heartbeat,
    HomePosition,
    LocalPosition,
    Message,
    MessageId,
    MissionCurrent,
    RawImu,
    RcChannels,
    RoverMode,
    ScaledImu,
    Sensor,
    ServoOutputs,
    SysStatus,
    VfrHud,
)
from sim_vehicles.autopilot import Autopilot, system_status
from sim_vehicles.battery import BatteryState, loads
from sim_vehicles.copter_modes import copter_number
from sim_vehicles.estimator import Estimate
from sim_vehicles.innovation import Innovation
from sim_vehicles.sensors import GpsFix, Inertial, Vector
from sim_vehicles.services.piloting import Sticks

SATELLITES, HDOP = 18, 0.7
FEW_SATELLITES, POOR_HDOP = 4, 10.0  # of a receiver that knows that it is not to be trusted
CPU_LOAD = 0.25
VERSION = (4, 6, 0, 255)  # the ArduPilot release whose behaviour is followed; 255 is 'official'
_MODE_FLAGS = {
    RoverMode.MANUAL: MODE_FLAG_MANUAL,
    RoverMode.GUIDED: MODE_FLAG_GUIDED,
    RoverMode.AUTO: MODE_FLAG_GUIDED,
    RoverMode.RTL: MODE_FLAG_GUIDED,
}
_ALWAYS_HEALTHY = (
    Sensor.GYRO | Sensor.ACCEL | Sensor.MAG | Sensor.YAW_POSITION | Sensor.XY_POSITION_CONTROL
) | (Sensor.MOTOR_OUTPUTS | Sensor.BATTERY)
FIELD_GAUSS = (0.215, 0.43)  # horizontal and down, in central Europe
_EKF_ALWAYS = EkfFlag.ATTITUDE | EkfFlag.VELOCITY_VERT | EkfFlag.POS_VERT_ABS
_EKF_WITH_GPS = (
    EkfFlag.VELOCITY_HORIZ
    | EkfFlag.POS_HORIZ_REL
    | EkfFlag.POS_HORIZ_ABS
    | EkfFlag.PRED_POS_HORIZ_REL
    | EkfFlag.PRED_POS_HORIZ_ABS
)
ALL_WELL = Sensor(0)
_WHEN_READY = Sensor.AHRS | Sensor.PREARM_CHECK


class LandedState(IntEnum):
    """MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    LANDING = 4


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All that telemetry may tell: of faults only which part has noticed one (`unhealthy`)."""

    sysid: int
    now_s: float
    origin: Origin
    estimate: Estimate
    ready: bool
    autopilot: Autopilot
    fix: GpsFix | None
    home_m: Vector | None
    pwm_us: tuple[int, ...]
    battery: BatteryState
    mission: MissionCurrent
    fence: FenceStatus | None  # None while it is switched off
    inertial: Inertial | None
    innovation: Innovation
    escs: EscTelemetry
    sticks: Sticks
    airframe: Airframe
    landed: LandedState = LandedState.ON_GROUND
    unhealthy: Sensor = ALL_WELL

    @property
    def flies(self) -> bool:
        return self.airframe.flight is not None


def heartbeat(s: Snapshot) -> Heartbeat:
    status = system_status(s.autopilot, s.ready)
    base_mode = MODE_FLAG_CUSTOM | _MODE_FLAGS.get(s.autopilot.mode, 0)
    mode = int(s.autopilot.mode)
    if s.flies:
        told_to_land = s.autopilot.mode is RoverMode.HOLD and s.landed is LandedState.LANDING
        mode = copter_number(s.autopilot.mode, told_to_land)
    kind = TYPE_QUADROTOR if s.flies else TYPE_ROVER
    return Heartbeat(kind, AUTOPILOT_ARDUPILOT, s.autopilot.armed, mode, int(status), base_mode)


def sys_status(s: Snapshot) -> SysStatus:
    present = int(_ALWAYS_HEALTHY | _WHEN_READY | Sensor.GPS)
    health = int(_ALWAYS_HEALTHY)
    if s.fix is not None:
        health |= int(Sensor.GPS)
    if s.ready:
        health |= int(_WHEN_READY)
    if s.fence is not None:
        present |= int(Sensor.GEOFENCE)
    if s.fence is None or not s.fence.breached:
        health |= int(Sensor.GEOFENCE)  # a fence that is switched off is healthy, too
    health &= ~int(s.unhealthy)
    battery = (s.battery.voltage_v, s.battery.current_a, s.battery.remaining_percent)
    return SysStatus(present, present, health, CPU_LOAD, *battery)


def gps_raw(s: Snapshot) -> GpsRaw:
    if s.fix is None:
        return GpsRaw(s.now_s, FixType.NO_FIX, 0.0, 0.0, 0.0, 99.99, 0.0, 0.0, 0)
    (n, e, d), (vn, ve, _) = s.fix.position_m, s.fix.velocity_mps
    lat, lon = ned_to_wgs84(n, e, s.origin)
    motion = (math.hypot(vn, ve), math.atan2(ve, vn))
    where = (lat, lon, s.origin.alt_m - d)
    if Sensor.GPS in s.unhealthy:
        return GpsRaw(s.fix.time_s, FixType.FIX_3D, *where, POOR_HDOP, *motion, FEW_SATELLITES)
    return GpsRaw(s.fix.time_s, FixType.RTK_FIXED, *where, HDOP, *motion, SATELLITES)


def global_position(s: Snapshot) -> GlobalPosition | None:
    if s.home_m is None:
        return None
    n, e, d = s.estimate.position_m
    lat, lon = ned_to_wgs84(n, e, s.origin)
    heights = (s.origin.alt_m - d, s.home_m[2] - d)
    return GlobalPosition(s.now_s, lat, lon, *heights, s.estimate.velocity_mps, s.estimate.yaw_rad)


def local_position(s: Snapshot) -> LocalPosition | None:
    if s.home_m is None:
        return None
    return LocalPosition(s.now_s, s.estimate.position_m, s.estimate.velocity_mps)


def attitude(s: Snapshot) -> Attitude:
    e = s.estimate
    return Attitude(s.now_s, e.roll_rad, e.pitch_rad, e.yaw_rad, *e.gyro_radps)


def servo_outputs(s: Snapshot) -> ServoOutputs:
    return ServoOutputs(s.now_s, s.pwm_us)


def battery_status(s: Snapshot) -> Battery:
    b = s.battery
    return Battery(b.voltage_v, b.current_a, b.consumed_mah, b.remaining_percent)


def extended_sys_state(s: Snapshot) -> ExtendedSysState:
    return ExtendedSysState(int(s.landed))


def home_position(s: Snapshot) -> HomePosition | None:
    if s.home_m is None:
        return None
    lat, lon = ned_to_wgs84(s.home_m[0], s.home_m[1], s.origin)
    return HomePosition(lat, lon, s.origin.alt_m - s.home_m[2], s.home_m)


def gps_origin(s: Snapshot) -> GpsOrigin | None:
    if s.home_m is None:
        return None
    return GpsOrigin(s.origin.lat_deg, s.origin.lon_deg, s.origin.alt_m)


def mission_current(s: Snapshot) -> MissionCurrent:
    return s.mission


def fence_status(s: Snapshot) -> FenceStatus | None:
    return s.fence


def raw_imu(s: Snapshot) -> RawImu | None:
    return None if s.inertial is None else RawImu(s.now_s, *_inertial(s.inertial))


def scaled_imu(s: Snapshot) -> ScaledImu | None:
    return None if s.inertial is None else ScaledImu(s.now_s, *_inertial(s.inertial))


def _inertial(sample: Inertial) -> tuple[Vector, Vector, Vector]:
    """Specific force, rates and field, in body axes of a level vehicle."""
    level_gauss, down_gauss = FIELD_GAUSS
    yaw = sample.compass_rad
    field = (level_gauss * math.cos(yaw), -level_gauss * math.sin(yaw), down_gauss)
    return sample.accel_mps2, sample.gyro_radps, field


def ekf_status(s: Snapshot) -> EkfStatus:
    placed = s.ready and s.fix is not None
    flags = _EKF_ALWAYS | (_EKF_WITH_GPS if placed else EkfFlag.CONST_POS_MODE)
    if Sensor.GPS in s.unhealthy:
        flags = (flags & ~EkfFlag.POS_HORIZ_ABS) | EkfFlag.GPS_GLITCHING
    return EkfStatus(
        s.innovation.velocity, s.innovation.position, s.innovation.height, 0.0, int(flags)
    )


def esc_telemetry(s: Snapshot) -> EscTelemetry:
    return s.escs


def vfr_hud(s: Snapshot) -> VfrHud:
    vn, ve, vd = s.estimate.velocity_mps
    outputs = [pwm_to_output(pwm) for pwm in s.pwm_us[: len(s.airframe.motors)]]
    throttle = sum(loads(s.airframe, outputs)) / len(outputs)
    alt_m = s.origin.alt_m - s.estimate.position_m[2]
    return VfrHud(math.hypot(vn, ve), alt_m, -vd, s.estimate.yaw_rad, throttle)


def rc_channels(s: Snapshot) -> RcChannels | None:
    """The sticks as channels 1 to 4, as `services/piloting.py` has them; None before any moved."""
    sticks = s.sticks
    if sticks.moved_s == -math.inf:
        return None
    axes = (sticks.steering, 0.0, sticks.throttle, sticks.lateral)
    if s.flies:
        axes = (sticks.lateral, -sticks.ahead, sticks.throttle, sticks.steering)
    return RcChannels(s.now_s, tuple(round(1500 + 500 * axis) for axis in axes))


def autopilot_version(s: Snapshot) -> AutopilotVersion:
    capabilities = (
        Capability.PARAM_FLOAT
        | Capability.PARAM_ENCODE_C_CAST
        | Capability.MISSION_INT
        | Capability.MISSION_FENCE
        | Capability.MISSION_RALLY
        | Capability.COMMAND_INT
        | Capability.SET_POSITION_TARGET_LOCAL_NED
        | Capability.SET_POSITION_TARGET_GLOBAL_INT
        | Capability.MAVLINK2
    )
    return AutopilotVersion(int(capabilities), VERSION, s.sysid)


BUILDERS: Mapping[MessageId, Callable[[Snapshot], Message | None]] = {
    MessageId.HEARTBEAT: heartbeat,
    MessageId.SYS_STATUS: sys_status,
    MessageId.GPS_RAW_INT: gps_raw,
    MessageId.GLOBAL_POSITION_INT: global_position,
    MessageId.LOCAL_POSITION_NED: local_position,
    MessageId.ATTITUDE: attitude,
    MessageId.SERVO_OUTPUT_RAW: servo_outputs,
    MessageId.BATTERY_STATUS: battery_status,
    MessageId.EXTENDED_SYS_STATE: extended_sys_state,
    MessageId.HOME_POSITION: home_position,
    MessageId.GPS_GLOBAL_ORIGIN: gps_origin,
    MessageId.MISSION_CURRENT: mission_current,
    MessageId.AUTOPILOT_VERSION: autopilot_version,
    MessageId.FENCE_STATUS: fence_status,
    MessageId.RAW_IMU: raw_imu,
    MessageId.SCALED_IMU: scaled_imu,
    MessageId.EKF_STATUS_REPORT: ekf_status,
    MessageId.ESC_TELEMETRY_1_TO_4: esc_telemetry,
    MessageId.VFR_HUD: vfr_hud,
    MessageId.RC_CHANNELS: rc_channels,
}
