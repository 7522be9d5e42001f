"""What goes between the station and its planner process, as typed values and as JSON lines.

JSON, not pickle: nothing that arrives here can run code.
"""

import json
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from base_station.belief.hypotheses import Hypothesis
from hil.faults import Fault, Type, Unit

Array = NDArray[np.float64]
Kind = Literal["alpha", "beta"]


@dataclass(frozen=True)
class PlanRequest:
    """Learn a plan from where each twin stands now.

    `states` is [H, V, S] (twin states, see `base_station.twin`), one row per hypothesis that has a
    twin, vehicles in fleet order. For 'beta' H = 1: the verdict. `delivered` says per vehicle
    whether its goal has been reached already ('beta').
    """

    number: int
    kind: Kind
    seed: int
    preset: str
    hypotheses: tuple[Hypothesis, ...]
    posterior: tuple[float, ...]
    states: Array
    delivered: tuple[bool, ...]


@dataclass(frozen=True)
class PlanProgress:
    """How a training is getting on; `attempt` counts restarts from 0."""

    number: int
    kind: Kind
    attempt: int
    timesteps: int
    total_timesteps: int
    mean_reward: float


@dataclass(frozen=True)
class Contact:
    """Two vehicles (system ids) that a plan lets touch: impulse and closing speed that 90 % of
    draws stay below, under the hypothesis that expects more."""

    between: tuple[int, int]
    impulse_ns: float
    speed_mps: float


@dataclass(frozen=True)
class Prediction:
    """What a plan is expected to bring and to cost, over the twin's uncertain parameters.

    `information_bits` of the `open_bits` that the hypotheses leave: the mean over draws, and
    `information_low_bits`, their 10th percentile. `energy_j` is mean work against rolling
    resistance, `cost` the price of contacts, time and energy in units of `information`'s reward.
    """

    open_bits: float
    information_bits: float
    information_low_bits: float
    contacts: tuple[Contact, ...]
    duration_s: float
    energy_j: float
    cost: float


@dataclass(frozen=True)
class OpenLoopPlan:
    """Plan alpha: set-points [K, V, 3] (north m/s, east m/s, yaw rad; NaN yaw: not commanded).

    Each row is held for `period_s`. `held` lists the vehicles (by index) that get no set-points
    at all. `predicted_error` is the chance of confusing the worst pair of hypotheses, at the 10th
    percentile of the twin's uncertain parameters. `predicted_reports` [H, K+1, V, 2] is what each
    twin expects the station to receive (north, east).
    """

    setpoints: Array
    period_s: float
    held: tuple[int, ...]
    predicted_error: float
    predicted_reports: Array
    prediction: Prediction | None = None

    @property
    def solo(self) -> bool:
        """Whether one vehicle is driven alone, and nobody is to be touched."""
        return len(self.held) == int(self.setpoints.shape[1]) - 1


@dataclass(frozen=True)
class PolicyWeights:
    """A closed-loop plan: a tanh MLP as plain arrays. Layers are (weight [out, in], bias)."""

    layers: tuple[tuple[Array, Array], ...]


@dataclass(frozen=True)
class Script:
    """A closed-loop plan that is a rule of ours, by name; it was tried on the twin."""

    name: str


Policy = PolicyWeights | Script


@dataclass(frozen=True)
class Training:
    """One training, accepted or rejected; `curve` rows are (timesteps, mean episode reward)."""

    planner: str
    preset: str
    attempt: int
    accepted: bool
    timesteps: int
    wall_s: float
    curve: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class PlanReady:
    """The answer to a PlanRequest. Both plans are None when every restart missed its target.

    `predicted_m` [K+1, V, 2] is where the believed twin goes under `policy` (north, east), one row
    per control period of 1 / `control_hz`.
    `reused`: it was learned before, from the same; `trainings` are those of then.
    """

    number: int
    kind: Kind
    trainings: tuple[Training, ...]
    plan: OpenLoopPlan | None = None
    policy: Policy | None = None
    predicted_m: Array | None = None
    reused: bool = False


Message = PlanRequest | PlanProgress | PlanReady
_TYPES = {t.__name__: t for t in (PlanRequest, PlanProgress, PlanReady)}


def encode(message: Message) -> str:
    """One JSON line, without the newline."""
    return json.dumps({"type": type(message).__name__, **asdict(message)}, default=_plain)


def decode(line: str) -> Message:
    """The inverse of `encode`. Raises ValueError on anything else."""
    tree = json.loads(line)
    if not isinstance(tree, dict) or tree.get("type") not in _TYPES:
        raise ValueError(f"not a planner message: {line[:80]}")
    fields = {k: v for k, v in tree.items() if k != "type"}
    if tree["type"] == "PlanRequest":
        fields["hypotheses"] = tuple(_hypothesis(h) for h in fields["hypotheses"])
        fields["posterior"] = tuple(fields["posterior"])
        fields["states"] = _array(fields["states"])
        fields["delivered"] = tuple(fields["delivered"])
    elif tree["type"] == "PlanReady":
        fields["trainings"] = tuple(_training(t) for t in fields["trainings"])
        fields["plan"] = _plan(fields["plan"])
        fields["policy"] = _policy(fields["policy"])
        if fields["predicted_m"] is not None:
            fields["predicted_m"] = _array(fields["predicted_m"])
    message: Message = _TYPES[tree["type"]](**fields)
    return message


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"cannot be sent to the planner: {type(value).__name__}")


def _array(rows: Any) -> Array:
    return np.asarray(rows, dtype=np.float64)


def _hypothesis(tree: dict[str, Any]) -> Hypothesis:
    fault = tree["fault"]
    return Hypothesis(
        tree["name"],
        tree["sysid"],
        tree["prior"],
        fault
        and Fault(
            Unit(fault["unit"]),
            Type(fault["type"]),
            tuple(fault["instances"]),
            tuple(fault["axes"]),
            tuple(fault["size"]),
        ),
    )


def _training(tree: dict[str, Any]) -> Training:
    curve = tuple((float(x), float(y)) for x, y in tree["curve"])
    return Training(**{**tree, "curve": curve})


def _plan(tree: dict[str, Any] | None) -> OpenLoopPlan | None:
    if tree is None:
        return None
    return OpenLoopPlan(
        _array(tree["setpoints"]),
        tree["period_s"],
        tuple(tree["held"]),
        tree["predicted_error"],
        _array(tree["predicted_reports"]),
        _prediction(tree["prediction"]),
    )


def _prediction(tree: dict[str, Any] | None) -> Prediction | None:
    if tree is None:
        return None
    contacts = tuple(
        Contact((c["between"][0], c["between"][1]), c["impulse_ns"], c["speed_mps"])
        for c in tree["contacts"]
    )
    return Prediction(**{**tree, "contacts": contacts})


def _policy(tree: dict[str, Any] | None) -> Policy | None:
    if tree is None:
        return None
    if "name" in tree:
        return Script(tree["name"])
    return PolicyWeights(tuple((_array(w), _array(b)) for w, b in tree["layers"]))
