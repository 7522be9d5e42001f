"""A skid-steer rover: two sides, turned by their difference."""

from hil.airframe.model import Airframe, Battery, Motor

# Size, mass, speed and battery are those of Clearpath's Jackal (data sheet: 508 x 430 x 250 mm,
# 17 kg, 2.0 m/s, 270 Wh); track 0.376 m and wheelbase 0.262 m from its robot description.
_MASS_KG, _HALF_TRACK_M, _WHEELBASE_M = 17.0, 0.188, 0.262
_GRIP = 0.7  # rubber on dry ground
_SCRUB = 0.4  # of tyres that roll while they slide: lower
_WEIGHT_N = 166.7


def _side(y_m: float) -> Motor:
    return Motor((0.0, y_m), (1.0, 0.0), 45.0, 2.4, grip_n=_GRIP * _WEIGHT_N / 2.0)


SKID_STEER = Airframe(
    name="skid_steer",
    radius_m=0.33,
    mass_kg=_MASS_KG,
    yaw_inertia_kgm2=_MASS_KG * (0.508**2 + 0.430**2) / 12.0,  # a box
    rolling_resistance=0.06,
    # wheels scrub sideways in a turn: M = mu W L / 4 (Wong, Theory of Ground Vehicles, ch. 6)
    yaw_resistance_nm=_SCRUB * _WEIGHT_N * _WHEELBASE_M / 4.0,
    speed_limit_mps=1.5,
    motors=(_side(-_HALF_TRACK_M), _side(_HALF_TRACK_M)),  # left, right
    steering="skid",
    side_grip=_GRIP,
    drag_area_m2=0.1,
    height_m=0.25,
    battery=Battery(capacity_mah=10_000.0, full_v=29.4, empty_v=24.0, motor_a=10.0),
)
