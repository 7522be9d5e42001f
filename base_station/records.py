"""What the station tells the outside: events and snapshots. Listeners only read them."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Phase = Literal[
    "connect",  # wait for heartbeats and positions
    "arm",
    "probe",  # [0a] tiny displacements
    "plan_alpha",  # [1] learn to tell the hypotheses apart
    "experiment",  # [2] drive plan alpha, compare
    "plan_beta",  # [3] learn the mission under the verdict
    "mission",  # [4] drive plan beta
    "return",  # rovers that left their goal to help go back to it
    "hold",  # stopped: cannot tell, takeover, time-out
    "done",
]

EventKind = Literal[
    "phase",
    "link",
    "anomaly",
    "hypotheses",
    "training",
    "plan",
    "contact",
    "verdict",
    "goal",
    "takeover",
    "command",
    "text",
    "end",
]


@dataclass(frozen=True)
class Event:
    """Something worth a line. `time_s` is fleet time; `data` holds plain JSON values only."""

    time_s: float
    kind: EventKind
    text: str
    data: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class VehicleSnapshot:
    """A vehicle as the station sees it (NED, m, m/s, rad); NaN where nothing is known."""

    sysid: int
    name: str
    phase: str  # 'idle', 'probing', 'suspect', 'experiment', 'mission', 'helping', 'home', 'held'
    reported_m: tuple[float, float]
    velocity_mps: tuple[float, float]
    yaw_rad: float
    setpoint_mps: tuple[float, float] | None
    motor_outputs: tuple[float, ...]  # as reported in SERVO_OUTPUT_RAW, [-1, 1]
    battery_percent: float
    gps_satellites: int
    residual: tuple[float, float]  # normalised innovation, north and east
    cusum: tuple[float, float]  # test statistic, north and east


@dataclass(frozen=True)
class TwinSnapshot:
    """The fleet as one hypothesis believes it to be.

    `true_m` [V, 2] is where the twin believes the vehicles are, `report_m` [V, 2] what it expects
    to receive, `sigma_m` [V, 2] one standard deviation of that prediction.
    """

    hypothesis: str
    posterior: float
    log_likelihood: float
    true_m: Array
    report_m: Array
    sigma_m: Array
    yaw_rad: Array


@dataclass(frozen=True, eq=False)
class Foreseen:
    """The experiment under way: `reports_m` [H, K+1, V, 2] is what each of `hypotheses` expects
    to be received, from before the first set-point to after the last."""

    hypotheses: tuple[str, ...]
    reports_m: Array


@dataclass(frozen=True)
class Snapshot:
    """The station's whole belief at one instant; `threshold` is the alarm level of `cusum`.

    `foreseen` is there from before an experiment is driven until it is over.
    """

    time_s: float
    phase: Phase
    threshold: float
    vehicles: tuple[VehicleSnapshot, ...]
    twins: tuple[TwinSnapshot, ...]
    foreseen: Foreseen | None = None
