"""A quadcopter: four rotors in X, tilted to go anywhere."""

import math

from hil.airframe.model import UP, Airframe, Battery, Flight, Motor

# A Holybro X500. Mass, inertia, places of the motors and torque per thrust are those of PX4's model
# of it (github.com/PX4/PX4-gazebo-models, models/x500_base and models/x500): 2.0 kg, 0.0217, 0.0217
# and 0.040 kg m2, 0.174 m from both axes, 0.016 m. Its rotors give at most 8.5 N; 11 N is chosen,
# so that it hovers at less than half of its thrust, as real ones do. 4S battery (16.8 to 13.2 V, as
# in ArduPilot's Tools/Frame_params/Holybro-X500v2-bdshot.param); its capacity, the currents, drag,
# friction on the ground and damping are chosen.
_HALF_M = 0.25 * math.sqrt(0.5)  # a wheelbase of 500 mm
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
        tilt_inertia_kgm2=0.0217,
        tilt_damping_nms=0.02,
        drag_torque_m=0.016,
        # MOT_THST_EXPO; 0.65 for 10 inch propellers: ardupilot.org/copter, "Setting Up for Tuning"
        thrust_expo=0.65,
        tilt_limit_rad=math.radians(30.0),
        climb_limit_mps=2.5,  # WPNAV_SPEED_UP
        descent_limit_mps=1.5,  # WPNAV_SPEED_DN
        landing_mps=0.5,  # LAND_SPEED
    ),
)
