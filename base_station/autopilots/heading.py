"""How an autopilot that drives heading first follows a velocity: the gains that its twin has.

It turns its nose to where it is sent and drives at once, at the full speed, along its nose; in HOLD
its motors brake. Outputs are shares of full throttle. The names are those of what they do; the
adapter of an autopilot says which of its parameters they are.
"""

from typing import NamedTuple


class HeadingFirst(NamedTuple):
    """Gains and limits of the speed loop, then of the heading loop."""

    speed_ff: float  # output per m/s
    speed_p: float  # output per m/s of error ...
    speed_i: float  # ... and per m/s and second
    accel_mps2: float  # of the speed that is asked for
    slew_per_s: float  # of the throttle
    stop_mps: float  # slower than this it counts as stopped: no throttle, no integral
    heading_p: float  # rad/s per rad
    rate_max_radps: float
    turn_accel_radps2: float
    rate_ff: float  # output per rad/s
    rate_p: float
    rate_i: float
