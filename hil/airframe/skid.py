"""A skid-steer rover: two sides, turned by their difference."""

from hil.airframe.model import Airframe, Battery, Motor

# Like Clearpath's Jackal: track and wheelbase, and the yaw inertia of chassis and wheels, are those
# of its robot description (github.com/jackal/jackal, jackal_description/urdf/jackal.urdf.xacro:
# 0.3756 and 0.262 m, 0.4485 kg m2, wheels of 0.477 kg). Mass (there 16.5 kg and the wheels), size,
# motors, speed, drag and battery are chosen to be about right.
_MASS_KG, _HALF_TRACK_M, _WHEELBASE_M, _WHEEL_KG = 17.0, 0.188, 0.262, 0.477
_GRIP = 0.7  # rubber slides on dry concrete at 0.6-0.85 (engineeringtoolbox.com, friction)
_SCRUB = 0.4  # chosen: tyres that roll while they slide have less
_WEIGHT_N = 166.7


def _side(y_m: float) -> Motor:
    return Motor((0.0, y_m), (1.0, 0.0), 45.0, 2.4, grip_n=_GRIP * _WEIGHT_N / 2.0)


SKID_STEER = Airframe(
    name="skid_steer",
    radius_m=0.33,
    mass_kg=_MASS_KG,
    yaw_inertia_kgm2=0.4485 + 4.0 * _WHEEL_KG * (_HALF_TRACK_M**2 + (_WHEELBASE_M / 2.0) ** 2),
    # 0.04-0.08: medium hard soil, loose gravel (engineeringtoolbox.com, rolling resistance)
    rolling_resistance=0.06,
    # wheels scrub sideways in a turn; M = mu W L / 4 is for a load that is even over the length
    yaw_resistance_nm=_SCRUB * _WEIGHT_N * _WHEELBASE_M / 4.0,
    speed_limit_mps=1.5,
    motors=(_side(-_HALF_TRACK_M), _side(_HALF_TRACK_M)),  # left, right
    steering="skid",
    side_grip=_GRIP,
    drag_area_m2=0.1,
    height_m=0.25,
    battery=Battery(capacity_mah=10_000.0, full_v=29.4, empty_v=24.0, motor_a=10.0),
)
