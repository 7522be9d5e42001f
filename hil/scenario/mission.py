"""What the station is to do and may do, and what must come out."""

from typing import Annotated, Literal

from pydantic import Field

from hil.scenario.fields import GroundSysId, Horizon, Model, NonNegative, Port, Positive, SysId

MIN_PUSH_MARGIN = 1.5


class Priors(Model):
    """Weight of each family of hypotheses before any evidence; normalised when used."""

    motor: Positive = 0.45
    gps: Positive = 0.45
    none: Positive = 0.05
    unknown: Positive = 0.05


class Diagnosis(Model):
    """`evidence`: reports of positions; or with them what the receivers say by themselves.
    `obeyed_within_s`: how long an order may take until it is surely obeyed (round trip, its
    spread, and what gets lost); by a slower link nothing is judged, and nobody is driven."""

    evidence: Literal["position", "position_and_fixes"] = "position"
    decide_at: Annotated[float, Field(gt=0.5, lt=1)] = 0.99
    plan_error: Annotated[float, Field(gt=0, lt=0.5)] = 0.01
    false_alarms_per_hour: Positive = 0.1
    obeyed_within_s: Positive = 0.85
    tries: Annotated[int, Field(ge=1, le=20)] = 3
    priors: Priors = Priors()


class Planning(Model):
    """`planner` finds the experiment; `mission` says whether the way home is learned, or a rule for
    vehicles that turn before they drive. `exploration` is how qtable
    and dqn choose commands; `workers` try side by side, 0: one for each core but one; `reuse` looks
    for a plan that was learned before from the very same."""

    planner: Literal[
        "ppo", "ppo_lstm", "qtable", "dqn", "cem", "shooting", "random", "gradient", "ram"
    ] = "ppo"
    mission: Literal["ppo", "nose_first"] = "ppo"
    exploration: Literal["greedy", "epsilon", "boltzmann"] = "epsilon"
    objective: Literal["paper_distance", "paper_printed", "information"] = "information"
    preset: Literal["tuned", "paper"] = "tuned"
    suspect: Literal["held", "commanded"] = "held"
    alpha_horizon_s: Horizon = 8.0
    beta_horizon_s: Horizon = 40.0
    restarts: Annotated[int, Field(ge=0, le=100)] = 20
    workers: Annotated[int, Field(ge=0, le=64)] = 0
    reuse: bool = True
    planning_sim_s: NonNegative = 2.0


class Manoeuvre(Model):
    """What an experiment may do, beside its duration (`planning.alpha_horizon_s`); None: no limit.

    `contacts` says who may touch whom: any two, only somebody and the suspect, or nobody;
    `untouchable` lists vehicles that nobody may touch.
    """

    contact_speed_mps: Positive | None = None
    contact_impulse_ns: Positive | None = None
    contacts: Literal["any", "suspect", "none"] = "any"
    untouchable: tuple[SysId, ...] = ()
    wall_margin_m: NonNegative = 0.0


class Limits(Model):
    """What the station allows itself."""

    manoeuvre: Manoeuvre = Manoeuvre()

    speed_mps: Positive = 1.0
    probe_speed_mps: Positive = 0.5
    probe_pulse_s: Annotated[float, Field(gt=0, le=2.0)] = 0.5
    goal_radius_m: Positive = 0.2
    mission_timeout_s: Positive = 180.0


class Links(Model):
    """Ports; None lets `hil run` pick free ones. Vehicle i uses base + 10 i."""

    host: str = "127.0.0.1"
    mavlink_port_base: Port | None = None
    physics_port_base: Port | None = None
    injector_port_base: Port | None = None
    station_sysid: GroundSysId = 250
    injector_sysid: GroundSysId = 251


GoalOutcome = Literal["reached", "uncertain", "unreached"]


class Expectation(Model):
    """What must come out for exit code 0. `hypothesis` is a name as `base_station` writes it."""

    alarm: bool = True
    sysid: SysId | None = None
    hypothesis: str | None = None
    goals: dict[SysId, tuple[GoalOutcome, ...]] = Field(default={})
