"""A quadcopter: four rotors in X, tilted to go anywhere."""

import math

from hil.airframe.model import UP, Airframe, Battery, Flight, Motor

# A Holybro X500 kit: 500 mm between opposite motors, 2.0 kg with its 4S 5 Ah battery, 10 inch
# propellers with about 11 N of thrust each. Inertia of that kit from public system models
# (0.02-0.03 kg m2 about x and y, 0.04 about z); torque per thrust 0.016 m is a 10 x 4.5 propeller.
_HALF_M = 0.25 * math.sqrt(0.5)
_THRUST_N = 11.0
_PITCH_MPS = 17.0  # 4.5 inch of pitch at 9,000 rpm


def _rotor(x: float, y: float, spin: int) -> Motor:
    return Motor((x * _HALF_M, y * _HALF_M), UP, _THRUST_N, _PITCH_MPS, spin=spin)


QUAD_X = Airframe(
    name="quad_x",
    radius_m=0.38,
    mass_kg=2.0,
    yaw_inertia_kgm2=0.04,
    rolling_resistance=0.5,  # its skids on the ground
    yaw_resistance_nm=0.5 * 2.0 * 9.81 * 0.15,
    speed_limit_mps=3.0,
    # ArduPilot's order: front right, rear left (both counter-clockwise), front left, rear right
    motors=(_rotor(1, 1, 1), _rotor(-1, -1, 1), _rotor(1, -1, -1), _rotor(-1, 1, -1)),
    steering="flight",
    frame_type=1,
    drag_area_m2=0.06,
    height_m=0.25,
    battery=Battery(capacity_mah=5_000.0, full_v=16.8, empty_v=13.2, motor_a=15.0),
    flight=Flight(
        tilt_inertia_kgm2=0.025,
        tilt_damping_nms=0.02,
        drag_torque_m=0.016,
        thrust_expo=0.55,  # ArduPilot advises 0.55 for 10 inch propellers (MOT_THST_EXPO)
        tilt_limit_rad=math.radians(30.0),
        climb_limit_mps=2.5,  # WPNAV_SPEED_UP
        descent_limit_mps=1.5,  # WPNAV_SPEED_DN
        landing_mps=0.5,  # LAND_SPEED
    ),
)
