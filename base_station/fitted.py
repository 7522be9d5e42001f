"""The twin of a fleet as it was identified: what `hil identify` found, where there is a fit.

Every model that plans, watches or doubts begins here, so all of them have the same vehicle.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from base_station.autopilots import HeadingFirst, adapter
from base_station.twin import FleetModel
from hil.scenario import FleetMember, StationView

Array = NDArray[np.float64]
SLEW = HeadingFirst._fields.index("slew_per_s")


def fleet_model(view: StationView) -> FleetModel:
    """The data sheets, and what was found: acceleration, rolling resistance, slew of the throttle.

    Latencies are `latency_s`'s concern; what a fit leaves unexplained is `residual_m`'s.
    """
    model = FleetModel.from_view(view)
    stall = model.nominal.stall_force_n.copy()
    rolling, helm = model.nominal.rolling_force_n.copy(), model.vehicles.helm.copy()
    for v, member in enumerate(view.fleet):
        frame = member.frame
        for axis, fit in member.identified.items():
            if fit.model not in ("integrating", "heading_first"):
                continue  # it says how fast speed follows, not why
            motors = [i - 1 for i in frame.axis_motors(axis)]
            accel, second, *_ = fit.parameters
            stall[0, v, motors] *= accel * frame.mass_kg / frame.axis_stall_force_n(axis)
            if fit.model == "heading_first":
                helm[v, SLEW] = second
            else:
                rolling[0, v] = second * frame.mass_kg
    return replace(
        model,
        vehicles=model.vehicles._replace(helm=helm),
        nominal=model.nominal._replace(stall_force_n=stall, rolling_force_n=rolling),
    )


def latency_s(member: FleetMember) -> float:
    """From the arrival of a set-point to its effect: as found, or as the adapter has it.

    What the link took then is not the vehicle's: what it takes now is measured all the time.
    """
    found = [max(0.0, fit.latency_s - fit.link_s) for fit in member.identified.values()]
    return max(found) if found else adapter(member.autopilot, member.frame).latency_s


def residual_m(view: StationView) -> Array:
    """[V] what the fits leave unexplained of a position; 0 where nobody has looked."""
    fits = [[fit.residual_m for fit in member.identified.values()] for member in view.fleet]
    return np.array([max(of_axes, default=0.0) for of_axes in fits])
