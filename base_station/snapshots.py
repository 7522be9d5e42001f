"""The station's belief at one tick, for listeners (pure)."""

import numpy as np
from numpy.typing import NDArray

from base_station import twin
from base_station.desk import Desk
from base_station.phases import Concluding, Experimenting, OnMission, Probing, Returning
from base_station.receiving.telemetry import Frame
from base_station.records import Foreseen, Snapshot, TwinSnapshot, VehicleSnapshot

Array = NDArray[np.float64]

SHOWN = 1e-3  # explanations less likely than this are nobody's business


def snapshot(desk: Desk, frame: Frame) -> Snapshot:
    """Everything the station knows and believes at `frame`."""
    watch = desk.watch
    vehicles = tuple(_vehicle(desk, frame, v) for v in range(len(desk.view.fleet)))
    return Snapshot(
        frame.time_s, desk.phase.name, watch.threshold, vehicles, _twins(desk), _foreseen(desk)
    )


def _foreseen(desk: Desk) -> Foreseen | None:
    match desk.phase:
        case Experimenting(plan, _, twins) if twins:
            return Foreseen(twins, plan.predicted_reports)
        case _:
            return None


def _vehicle(desk: Desk, frame: Frame, v: int) -> VehicleSnapshot:
    watch, member = desk.watch, desk.view.fleet[v]
    status, orders = desk.fleet.tracks[v].status, desk.orders
    north, east = (float(x) for x in frame.position_m[v])
    setpoint = (float(orders.setpoints[v, 0]), float(orders.setpoints[v, 1]))
    return VehicleSnapshot(
        sysid=member.sysid,
        name=member.name,
        phase=_vehicle_phase(desk, v),
        reported_m=(north, east),
        velocity_mps=(float(frame.velocity_mps[v, 0]), float(frame.velocity_mps[v, 1])),
        yaw_rad=float(frame.yaw_rad[v]),
        setpoint_mps=setpoint if orders.driven[v] else None,
        motor_outputs=status.motor_outputs,
        battery_percent=status.battery_percent,
        gps_satellites=status.gps_satellites,
        residual=(float(watch.residual[v, 0]), float(watch.residual[v, 1])),
        cusum=(float(watch.cusum.level[v, 0]), float(watch.cusum.level[v, 1])),
    )


def _vehicle_phase(desk: Desk, v: int) -> str:
    driven, delivered = bool(desk.orders.driven[v]), desk.goals.delivered[v]
    if desk.doubt is not None and desk.doubt.suspect == v:
        return "suspect"
    match desk.phase:
        case Probing():
            return "probing" if driven else "idle"
        case Experimenting() | Concluding():
            return "experiment" if driven else "held"
        case OnMission() | Returning():
            if delivered:
                return "helping" if driven else "home"
            return "mission"
        case _:
            return "home" if delivered else "idle"


def _twins(desk: Desk) -> tuple[TwinSnapshot, ...]:
    watch, doubt = desk.watch, desk.doubt
    if doubt is None:
        known = watch.baseline.known
        name = known[-1].name if known else "none"
        return (_twin(name, 1.0, 0.0, watch.state, watch.report_m, watch.sigma_m),)
    posterior, (states, reports, sigmas) = doubt.posterior, doubt.of_twins()
    twins, weights = [], doubt.log_weights
    for k, hypothesis in enumerate(doubt.twins):
        if posterior[k] < SHOWN:
            continue
        sigma = np.zeros_like(reports[k])
        sigma[doubt.suspect] = sigmas[k]
        weight = float(weights[k])
        twins.append(
            _twin(hypothesis.name, float(posterior[k]), weight, states[k], reports[k], sigma)
        )
    return tuple(twins)


def _twin(
    name: str,
    posterior: float,
    log_likelihood: float,
    state: Array,
    report_m: Array,
    sigma_m: Array,
) -> TwinSnapshot:
    true_m = state[:, twin.NORTH : twin.EAST + 1].copy()
    yaw_rad = state[:, twin.YAW].copy()
    return TwinSnapshot(name, posterior, log_likelihood, true_m, report_m, sigma_m, yaw_rad)
